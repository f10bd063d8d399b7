#pragma once

// Checks whether matched corners of two keyframes agree with one relative pose.
//
// Both cameras know gravity, so the relative rotation of their odom frames is a yaw and three
// correspondences fix an essential matrix (Fraundorfer et al., IROS 2010): far fewer RANSAC samples
// than with five, and far fewer chance agreements. The best models are refined in all five degrees
// of freedom, with a prior on gravity.
//
// The number of inliers required follows from the matches themselves (a contrario, Moisan & Stival,
// IJCV 2004): the probability that unrelated matches agree with a model is measured on wrongly
// paired corners of the same two keyframes. No parallax is required: many essential matrices fit a
// rotation in place or a plane, and any of them leads to acceptance.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

namespace pangea {

// Largest residual of an inlier, in sigmas (one sigma is a pixel at the image centre, octave 0).
inline constexpr double kMaxEpipolarResidual = 3.0;
// Fewest inliers of a recognised place.
inline constexpr int kMinEpipolarInliers = 10;

// A corner's ray: unit length, in its keyframe's odom (gravity-aligned) axes; sigma in radians.
struct CornerRay {
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
  double sigma = 1e-3;
};

// p_b = R_b_a p_a + s * t_b_a, |t| = 1, s >= 0 unknown; a and b are axes parallel to the odom
// frames, with the origins in the two cameras.
struct EpipolarModel {
  Eigen::Quaterniond R_b_a = Eigen::Quaterniond::Identity();
  Eigen::Vector3d t_b_a = Eigen::Vector3d::UnitX();

  // First-order (Sampson) residual in sigmas; infinite if the point would lie behind a camera.
  double Residual(const CornerRay& a, const CornerRay& b) const;
};

struct EpipolarResult {
  EpipolarModel model;
  std::vector<int> inliers;  // indices into the pairs, ascending
  double log10_false_alarms = 0;
  bool accepted = false;
};

// All models that fit three pairs exactly. Public only for its test.
std::vector<EpipolarModel> SolveThreePairs(
    const std::vector<std::pair<CornerRay, CornerRay>>& pairs, const std::array<int, 3>& sample);

// The same pairs and the same seed give the same result.
EpipolarResult CheckEpipolar(const std::vector<std::pair<CornerRay, CornerRay>>& pairs,
                             uint64_t seed);

}  // namespace pangea
