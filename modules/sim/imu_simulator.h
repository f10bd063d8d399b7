#pragma once

// Simulates an IMU along a path: exact, or with white noise and random-walk biases.

#include <cstdint>
#include <vector>

#include "core/imu/imu.h"
#include "sim/path/spline_path.h"

namespace pangea::sim {

struct SimulatedImu {
  std::vector<int64_t> stamps_ns;
  std::vector<ImuSample> samples;
  // Biases at each sample; zero for a perfect IMU.
  std::vector<Eigen::Vector3d> gyro_bias;   // rad/s
  std::vector<Eigen::Vector3d> accel_bias;  // m/s^2
};

// Samples at begin, begin + 1/rate, ... up to `end_ns`.
SimulatedImu SimulateImu(const SplinePath& path, int64_t begin_ns, int64_t end_ns,
                         const ImuNoise& noise, bool perfect, uint64_t seed);

}  // namespace pangea::sim
