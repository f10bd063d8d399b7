#pragma once

// Limits on the IMU of a stationary body; motors or a fan may need larger ones.

namespace pangea::vio {

inline constexpr double kMaxStationaryRate = 0.05;  // rad/s, norm of mean rate minus bias

struct StationaryOptions {
  double accel_sigma = 0.3;  // m/s^2, standard deviation over a quarter of a second

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("accel_sigma", &accel_sigma, {0.01, 10}, "m/s^2",
                "at most, of the samples: more where motors shake the body");
  }
};

}  // namespace pangea::vio
