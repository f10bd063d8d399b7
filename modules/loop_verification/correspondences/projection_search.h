#pragma once

// Searches map points of one window in a keyframe of the other, near their projections by an
// alignment: the paper's forward and reverse projection (section IV.D).

#include <Eigen/Core>
#include <vector>

#include "loop_verification/correspondences/point_observation.h"

namespace pangea {

// Sigma of a corner on octave 0, pixels.
inline constexpr double kCornerSigma_px = 1.0;

// A point that should be seen in the keyframe.
struct Projection {
  int landmark = 0;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  bool found = false;
  // The viewpoint is so similar to the host's that the point should be found, unless occluded.
  bool comparable = false;
};

struct SearchResult {
  // Sorted by landmark; each landmark and each corner at most once
  std::vector<PointMatch> matches;
  std::vector<Projection> projections;
};

// `pose` is T_m_c with its covariance, for both directions.
SearchResult SearchByProjection(const WindowPair& windows, Direction direction, int frame,
                                const PoseEstimate& pose);

// Matches the newest keyframe's corners to the window's points by nearest descriptor, without a
// prediction. For a first guess; up to a third may be wrong.
std::vector<PointMatch> MatchByDescriptor(const WindowPair& windows, Direction direction,
                                          int max_hamming, double max_ratio);

}  // namespace pangea
