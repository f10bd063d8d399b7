#pragma once

// The odometry's options in an options file; `pangea-vio --print-options` prints all of them.

#include "core/imu/imu.h"
#include "vio/vio.h"

namespace pangea::vio {

// Noise of a live sensor; a recording brings its own.
struct LiveImuNoise : ImuNoise {
  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("gyro_noise_density", &gyro_noise_density, {1e-9, 1}, "rad/s/sqrt(Hz)", "");
    archive.Add("gyro_random_walk", &gyro_random_walk, {1e-9, 1}, "rad/s^2/sqrt(Hz)", "");
    archive.Add("accel_noise_density", &accel_noise_density, {1e-9, 10}, "m/s^2/sqrt(Hz)", "");
    archive.Add("accel_random_walk", &accel_random_walk, {1e-9, 10}, "m/s^3/sqrt(Hz)", "");
    archive.Add("rate_hz", &rate_hz, {1, 100'000}, "Hz", "samples");
    archive.Add("gyro_scale_sigma", &gyro_scale_sigma, {0, 1}, "",
                "share that calibration leaves; 0: it is exact");
    archive.Add("accel_scale_sigma", &accel_scale_sigma, {0, 1}, "",
                "share that calibration leaves; 0: it is exact");
    archive.Add("axes_sigma", &axes_sigma, {0, 1}, "rad",
                "that calibration leaves; 0: it is exact");
  }
};

struct VioFileOptions {
  VioOptions vio;
  LiveImuNoise live_imu;

  template <typename Archive>
  void Visit(Archive& archive) {
    vio.Visit(archive);
    archive.Section("live_imu", &live_imu, "noise of a live sensor; a recording brings its own");
  }
};

}  // namespace pangea::vio
