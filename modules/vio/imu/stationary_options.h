#pragma once

// Limits on a stationary body's IMU and images; motors or a fan may need larger ones of the IMU.

namespace pangea::vio {

inline constexpr double kMaxStationaryRate = 0.05;  // rad/s, norm of mean rate minus bias
// Of the mean specific force, if the body is shaken: shaking leaves the mean, setting off does not.
inline constexpr double kMaxStationaryAccelChange = 0.25;  // m/s^2
// Of the shift of the tracks, in sigmas: noise alone gives a median of 1.7, and 2.5 for most tracks
// (80 % quantile).
inline constexpr double kStationarySigmas = 2.2;
inline constexpr double kStationaryMostSigmas = 3.3;
inline constexpr double kMostTracks = 0.8;

struct StationaryOptions {
  double accel_sigma = 0.3;  // m/s^2, standard deviation over a quarter of a second

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("accel_sigma", &accel_sigma, {0.01, 10}, "m/s^2",
                "at most, of the samples: more where motors shake the body");
  }
};

}  // namespace pangea::vio
