#pragma once

// Simulates a camera and an IMU on a path, for tests of the steps of a moving start.

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "core/testing/test_cameras.h"
#include "vio/initialisation/initial_solution.h"

namespace pangea::vio {

inline constexpr double kStartRaySigma = 0.5 / 400;
inline const Eigen::Vector3d kGyroBias(0.02, -0.03, 0.01);
inline const Rigid3 kT_body_cam{LookingAhead() * ExpSo3({0.05, -0.03, 0.02}), {0.05, -0.02, 0.01}};

using Path = std::function<Rigid3(double)>;
Rigid3 Lively(double t);
Rigid3 RotatingEvenly(double t);
Eigen::Vector3d VelocityAt(const Path& path, double t);

struct StartWorld {
  std::vector<ImuSample> samples;
  std::vector<StartFrame> frames;  // taken `late_s` after their stamps
};

// Records 2 s of images at 10 Hz, beginning at t = 1 s of the path. The samples extend `margin_s`
// beyond both ends.
StartWorld Record(const Path& path, double late_s, double ray_sigma, double margin_s = 0.1,
                  uint64_t seed = 7, double stamp_sigma_s = 0);

}  // namespace pangea::vio
