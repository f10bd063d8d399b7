#pragma once

// Limits for two keyframes with a common view: the angle between their optical axes (for level
// cameras this is the paper's yaw; a camera that looks down may have any yaw), and their distance.

#include "loop_verification/steps/verification.h"

namespace pangea {

struct ViewOptions {
  double max_view_angle = 1.3;  // radians
  double max_distance_m = 15;

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("max_view_angle", &max_view_angle, {0.01, 3.15}, "rad",
                "between the two lines of sight");
    archive.Add("max_distance_m", &max_distance_m, {0.01, 10000}, "m", "between the two keyframes");
  }
};

std::string CheckViews(const ViewOptions& options, Verification* verification);

}  // namespace pangea
