#pragma once

// What the joint bundle adjustment must reach.

#include "loop_verification/steps/verification.h"

namespace pangea {

struct InlierOptions {
  int min_inliers = 16;           // distinct landmarks
  double min_inlier_ratio = 0.5;  // of the matches the BA used
  int min_occupied_cells = 6;     // of 6 x 4, in one of the two keyframes

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("min_inliers", &min_inliers, {4, 100000}, "", "distinct landmarks");
    archive.Add("min_inlier_ratio", &min_inlier_ratio, {0, 1}, "",
                "of the matches that the BA used");
    archive.Add("min_occupied_cells", &min_occupied_cells, {0, 24}, "",
                "of 6 x 4, in one of the two keyframes");
  }
};

// Accepted means: nearer to the truth than 0.5 m and 5 degrees. Five standard deviations of the
// worst direction, as images with few points err more often than a normal distribution says.
// Sure landmarks alone must keep it in position: vague matches that fit may be wrong ones.
struct CertaintyOptions {
  double max_sigma_m = 0.1;
  double max_sigma_rad = 0.0175;

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("max_sigma_m", &max_sigma_m, {0.001, 100}, "m", "of the worst direction");
    archive.Add("max_sigma_rad", &max_sigma_rad, {0.0001, 3.15}, "rad", "of the worst direction");
  }
};

// Between the poses of the view's two halves: 99.9 % of 6 degrees of freedom. What a real lens and
// a real IMU add is not in the covariances, so 99 % refused many right ones
// (docs/decisions/real_revisits.md).
struct HalvesOptions {
  double max_halves_chi2 = 22.5;

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("max_halves_chi2", &max_halves_chi2, {0.1, 100000}, "",
                "between the poses of the view's two halves, 6 degrees of freedom");
  }
};

// Projection search in all keyframes, fundamental matrix, and the bundle adjustment itself.
std::string Optimise(const InlierOptions& options, Verification* verification);

std::string CheckInliers(const InlierOptions& options, Verification* verification);
std::string CheckCertainty(const CertaintyOptions& options, Verification* verification);

// The left and the right half of what both see, each solved alone. A rotation of the view and a
// step to the side look alike over a narrow field; matches that are a little off then give a pose
// far off, which gravity does not contradict and the residuals do not show. But it differs from
// half to half. What both halves take from the odometries counts twice: the test lets pass too
// much rather than too little.
std::string CheckHalves(const HalvesOptions& options, Verification* verification);

}  // namespace pangea
