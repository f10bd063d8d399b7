#pragma once

// What a stationary body's IMU may show: more where motors or a ventilator shake it.

namespace pangea::vio {

struct StationaryOptions {
  double accel_sigma = 0.3;  // m/s^2, standard deviation over a quarter of a second
  double gyro_rate = 0.05;   // rad/s, mean rate less bias

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("accel_sigma", &accel_sigma, {0.01, 10}, "m/s^2",
                "at most, of the samples: more where motors shake the body");
    archive.Add("gyro_rate", &gyro_rate, {0.001, 1}, "rad/s", "at most, in the mean");
  }
};

}  // namespace pangea::vio
