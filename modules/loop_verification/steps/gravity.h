#pragma once

// Roll and pitch between two gravity-aligned frames are zero within what the odometries say.
// Guesses are led by it loosely, so that a wrong one is not bent into what gravity allows; what
// the images alone say in the end must agree with it: 99 % of 2 degrees of freedom. The
// odometries' claims do not count how well each knows its camera's rotation in its body; real
// ones know it to a quarter of a degree (docs/decisions/loop_verification.md).

#include "loop_verification/steps/verification.h"

namespace pangea {

struct GravityOptions {
  double gravity_floor = 0.005;  // radians, of each odometry, at the end
  double max_tilt_chi2 = 9.2;
  double max_tilt = 0.06;  // radians, whatever the odometries say

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

// Of roll or pitch between the two odometries, radians^2; each knows gravity no better than
// `floor`.
double TiltVariance(const WindowPair& windows, double floor);

std::string CheckGravity(const GravityOptions& options, Verification* verification);

}  // namespace pangea
