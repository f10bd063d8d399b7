#pragma once

// The paper's local window optimisation (section IV.D, figure 2): both windows' points are
// reprojected into the other window's keyframes, to estimate the relative pose jointly with all
// other uncertain variables:
//
//   min  sum rho(|r_reprojection|^2) + |r_point|^2 + |r_edge|^2 + |r_scale|^2
//
// over T_Km_Kc, the other keyframes' poses (constrained by odometry edges with the odometry's
// covariances), the points (bearing and inverse depth, with priors), and one scale per window:
// depths and edges of one odometry share a scale error that their own variances do not contain. So
// the covariance of T_Km_Kc includes all these uncertainties. The pixel noise of a point's host
// corner enters only once, however many keyframes see the point: matches of one landmark are not
// independent.

#include <optional>
#include <vector>

#include "loop_verification/correspondences/point_observation.h"

namespace pangea {

// Relative sigma of a window's scale, if its map is metric.
inline constexpr double kWindowScaleSigma = 0.01;

struct JointBaOptions {
  double pixel_sigma = 1.0;  // of a corner on octave 0
  // Systematic error that all corners of a view share and that does not average out: calibration,
  // blur, correlated depth errors of one odometry. It adds a rotation of this many pixels, and the
  // translation with the same effect at the median distance of the points.
  double systematic_px = 0.2;
  double max_chi2 = 9.2;         // of an inlier: 99 %, 2 degrees of freedom
  double max_depth_chi2 = 10.8;  // of a depth against its prior: 99.9 %, 1 degree of freedom
  // A landmark is sure if a match has at most this distance. Of ORB; the limit of another kind of
  // descriptors is as much larger as LimitsOf says.
  int sure_hamming = LimitsOf(DescriptorKind::kOrb).sure;
  int iterations = 8;  // in each of the two rounds

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("pixel_sigma", &pixel_sigma, {0.01, 20}, "px", "of a corner on octave 0");
    archive.Add("systematic_px", &systematic_px, {0, 20}, "px",
                "error that all corners of a view share");
    archive.Add("max_chi2", &max_chi2, {0.1, 1000}, "", "of an inlier, 2 degrees of freedom");
    archive.Add("max_depth_chi2", &max_depth_chi2, {0.1, 1000}, "",
                "of a point's depth against its prior, 1 degree of freedom");
    archive.Add("sure_hamming", &sure_hamming, {0, kDescriptorBits}, "bits",
                "of ORB: a landmark with one match as near is sure");
    archive.Add("iterations", &iterations, {1, 1000}, "", "of each of the two rounds");
  }
};

struct JointBaResult {
  Rigid3 T_m_c;                                // between the window frames
  Rigid3 T_Km_Kc;                              // bodies of the newest keyframes
  Matrix6d covariance = Matrix6d::Identity();  // of T_Km_Kc, in Km's body frame
  // The same without the single landmark that contributes most.
  Matrix6d covariance_without_one = Matrix6d::Identity();
  // The same with sure landmarks alone; empty if they do not determine the pose.
  std::optional<Matrix6d> covariance_of_sure;
  std::vector<bool> inlier;  // per match
  int num_inlier_observations = 0;
  double rms_px = 0;  // of the inliers, in pixels of octave 0
};

// Empty if the problem is degenerate, or would be without one landmark. kOfAllLandmarks: the
// covariances with fewer landmarks are not computed, which saves a third of the time.
enum class JointBaCovariances { kOfAllLandmarks, kAlsoOfFewer };
std::optional<JointBaResult> SolveJointBa(
    const WindowPair& windows, const std::vector<PointMatch>& matches, const Rigid3& T_m_c,
    const JointBaOptions& options,
    JointBaCovariances covariances = JointBaCovariances::kAlsoOfFewer);

}  // namespace pangea
