#pragma once

// The joint bundle adjustment, and the requirements on its result.

#include "loop_verification/steps/verification.h"

namespace pangea {

struct InlierOptions {
  int min_inliers = 16;           // distinct landmarks
  double min_inlier_ratio = 0.5;  // of the matches the BA used
  int min_occupied_cells = 6;     // of 6 x 4 image cells, in one of the two keyframes

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("min_inliers", &min_inliers, {4, 100000}, "", "distinct landmarks");
    archive.Add("min_inlier_ratio", &min_inlier_ratio, {0, 1}, "",
                "of the matches that the BA used");
    archive.Add("min_occupied_cells", &min_occupied_cells, {0, 24}, "",
                "of 6 x 4, in one of the two keyframes");
  }
};

// An accepted constraint should have an error below 0.5 m and 5 degrees. These are five standard
// deviations in the worst direction, because images with few points have large errors more often
// than a normal distribution. The position must also meet max_sigma_m with sure landmarks alone:
// vague matches that fit may be wrong.
struct CertaintyOptions {
  double max_sigma_m = 0.1;
  double max_sigma_rad = 0.0175;

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("max_sigma_m", &max_sigma_m, {0.001, 100}, "m", "of the worst direction");
    archive.Add("max_sigma_rad", &max_sigma_rad, {0.0001, 3.15}, "rad", "of the worst direction");
  }
};

// Limit between the poses of the view's two halves: 99.9 %, 6 degrees of freedom. The covariances
// lack the errors of a real lens and IMU, so a limit of 99 % refused many correct constraints
// (docs/decisions/real_revisits.md).
struct HalvesOptions {
  double max_halves_chi2 = 22.5;

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("max_halves_chi2", &max_halves_chi2, {0.1, 100000}, "",
                "between the poses of the view's two halves, 6 degrees of freedom");
  }
};

// Runs the projection search in all keyframes, the fundamental-matrix filter, and the bundle
// adjustment.
std::string Optimise(const InlierOptions& options, Verification* verification);

std::string CheckInliers(const InlierOptions& options, Verification* verification);
std::string CheckCertainty(const CertaintyOptions& options, Verification* verification);

// Solves the left and the right half of the common view separately and compares the poses. In a
// narrow field of view, a rotation and a sideways step look alike: slightly wrong matches then give
// a very wrong pose, which neither gravity nor the residuals reveal. But this pose differs between
// the halves. Both halves use the same odometry, whose covariance is thus counted twice: the test
// is too tolerant rather than too strict.
std::string CheckHalves(const HalvesOptions& options, Verification* verification);

}  // namespace pangea
