#pragma once

// Inertial samples, and the noise parameters of the sensor as in EuRoC's sensor.yaml.

#include <Eigen/Core>
#include <cstdint>

namespace pangea {

// Gravity in a gravity-aligned frame (z up), m/s^2.
constexpr double kGravity = 9.81;

struct ImuSample {
  int64_t utime = 0;                               // microseconds, sensor clock
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero();  // rad/s, body
  // Specific force, m/s^2, in the body frame. When the body is stationary it points up, with length
  // kGravity.
  Eigen::Vector3d accel = Eigen::Vector3d::Zero();
};

// Larger values come from a broken sensor or a wrong unit, not from a phone in a hand.
inline constexpr double kMaxGyro = 100;   // rad/s
inline constexpr double kMaxAccel = 500;  // m/s^2
inline bool IsPlausible(const ImuSample& sample) {
  return sample.gyro.allFinite() && sample.accel.allFinite() && sample.gyro.norm() <= kMaxGyro &&
         sample.accel.norm() <= kMaxAccel;
}

struct ImuNoise {
  double gyro_noise_density = 1.6968e-4;   // rad/s/sqrt(Hz)
  double gyro_random_walk = 1.9393e-5;     // rad/s^2/sqrt(Hz)
  double accel_noise_density = 2.0000e-3;  // m/s^2/sqrt(Hz)
  double accel_random_walk = 3.0000e-3;    // m/s^3/sqrt(Hz)
  double rate_hz = 200;
  // Standard deviations of the scale factors (a share) and of the axes (rad) after calibration. 0:
  // exact.
  double gyro_scale_sigma = 0.002;
  double accel_scale_sigma = 0.001;
  double axes_sigma = 0.002;
};

}  // namespace pangea
