#pragma once

// The paper's local window optimisation (section IV.D, figure 2): both windows' points reprojected
// into the other window's keyframes, over the relative pose, with what is uncertain beside it:
//
//   min  sum rho(|r_reprojection|^2) + |r_point|^2 + |r_edge|^2 + |r_scale|^2
//
// over T_Km_Kc and the other keyframes' poses (held by their odometry edges with the covariances
// the odometry gave), the points (bearing and inverse depth, with priors), and one scale a window:
// depths and edges of one odometry share a scale error that their own variances do not show.
// So the covariance of T_Km_Kc counts all of it. The pixel noise of a point's host corner enters
// once however many keyframes see the point: matches of one landmark are not independent.

#include <optional>
#include <vector>

#include "loop_verification/correspondences/point_observation.h"

namespace pangea {

// Share by which a window may be larger than its odometry says.
inline constexpr double kWindowScaleSigma = 0.01;

struct JointBaOptions {
  double pixel_sigma = 1.0;  // of a corner on octave 0
  // What all corners of a view share and no number of them averages out: calibration, blur, the
  // correlated errors of one odometry's depths. A rotation by so many pixels, and the sideways step
  // that looks the same at the points' median distance.
  double systematic_px = 0.2;
  double max_chi2 = 9.2;            // of an inlier: 99 % of 2 degrees of freedom
  double max_depth_chi2 = 10.8;     // of a point's depth against its prior: 99.9 % of one
  int sure_hamming = kSureHamming;  // a landmark is sure that is so alike in one match
  int iterations = 8;               // each of the two rounds

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("pixel_sigma", &pixel_sigma, {0.01, 20}, "px", "of a corner on octave 0");
    archive.Add("systematic_px", &systematic_px, {0, 20}, "px",
                "error that all corners of a view share");
    archive.Add("max_chi2", &max_chi2, {0.1, 1000}, "", "of an inlier, 2 degrees of freedom");
    archive.Add("max_depth_chi2", &max_depth_chi2, {0.1, 1000}, "",
                "of a point's depth against its prior, 1 degree of freedom");
    archive.Add("sure_hamming", &sure_hamming, {0, kDescriptorBits}, "bits",
                "a landmark with one match as near is sure");
    archive.Add("iterations", &iterations, {1, 1000}, "", "of each of the two rounds");
  }
};

struct JointBaResult {
  Rigid3 T_m_c;                                // windows
  Rigid3 T_Km_Kc;                              // bodies of the newest keyframes
  Matrix6d covariance = Matrix6d::Identity();  // of T_Km_Kc, in Km's body frame
  // The same if the landmark that says most were not there.
  Matrix6d covariance_without_one = Matrix6d::Identity();
  // The same if there were none but sure landmarks; nothing when they do not fix the pose.
  std::optional<Matrix6d> covariance_of_sure;
  std::vector<bool> inlier;  // by match
  int num_inlier_observations = 0;
  double rms_px = 0;  // of the inliers, in pixels of octave 0
};

// Nothing when the problem degenerates.
std::optional<JointBaResult> SolveJointBa(const WindowPair& windows,
                                          const std::vector<PointMatch>& matches,
                                          const Rigid3& T_m_c, const JointBaOptions& options);

}  // namespace pangea
