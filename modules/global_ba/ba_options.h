#pragma once

#include "core/imu/imu.h"

namespace pangea {

struct BaOptions {
  // Random walks of the biases; each preintegration contains its white noise.
  ImuNoise imu;
  // Sigmas of the zero-mean prior on the biases of a map's first keyframe.
  double gyro_bias_sigma = 0.05;   // rad/s
  double accel_bias_sigma = 0.15;  // m/s^2
  double loss_scale = 2.0;         // sigmas
  double max_chi2 = 9.2;           // of an inlier: 99 %, 2 degrees of freedom
  int max_iterations = 10;         // in each of the two rounds
  double function_tolerance = 5e-4;

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("gyro_random_walk", &imu.gyro_random_walk, {1e-9, 1}, "rad/s^2/sqrt(Hz)",
                "of the gyro's bias");
    archive.Add("accel_random_walk", &imu.accel_random_walk, {1e-9, 1}, "m/s^3/sqrt(Hz)",
                "of the accelerometer's bias");
    archive.Add("gyro_bias_sigma", &gyro_bias_sigma, {1e-6, 10}, "rad/s",
                "of a map's first keyframe, about zero");
    archive.Add("accel_bias_sigma", &accel_bias_sigma, {1e-6, 100}, "m/s^2",
                "of a map's first keyframe, about zero");
    archive.Add("loss_scale", &loss_scale, {0.1, 100}, "sigmas", "of the robust loss");
    archive.Add("max_chi2", &max_chi2, {0.1, 1000}, "", "of an inlier, 2 degrees of freedom");
    archive.Add("max_iterations", &max_iterations, {1, 10000}, "", "of each of the two rounds");
    archive.Add("function_tolerance", &function_tolerance, {0, 1}, "",
                "relative decrease of the cost at which a round ends");
  }
};

}  // namespace pangea
