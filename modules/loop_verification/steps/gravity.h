#pragma once

// Roll and pitch between two gravity-aligned frames must be zero within the odometries'
// covariances. Initial poses have only a weak gravity prior, so that a wrong pose is not forced to
// agree with gravity. The final pose, from the images alone, must agree (99 %, 2 degrees of
// freedom). The odometries' covariances do not contain the error of the camera's rotation in the
// body; for real sensors it is a quarter of a degree (docs/decisions/loop_verification.md).

#include "loop_verification/steps/verification.h"

namespace pangea {

struct GravityOptions {
  double gravity_floor = 0.005;  // radians, minimum sigma of each odometry's tilt
  double max_tilt_chi2 = 9.2;
  double max_tilt = 0.06;  // radians, for any covariance

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("gravity_floor", &gravity_floor, {0, 1}, "rad",
                "sigma of each gravity, at least, at the end");
    archive.Add("max_tilt_chi2", &max_tilt_chi2, {0.1, 1000}, "",
                "of the tilt between the two gravities, 2 degrees of freedom");
    archive.Add("max_tilt", &max_tilt, {0.001, 3.15}, "rad",
                "between the two gravities, whatever the odometries say");
  }
};

// Variance of roll or pitch between the two odometries, radians^2. `floor`: added sigma of each
// odometry, radians.
double TiltVariance(const WindowPair& windows, double floor);

std::string CheckGravity(const GravityOptions& options, Verification* verification);

}  // namespace pangea
