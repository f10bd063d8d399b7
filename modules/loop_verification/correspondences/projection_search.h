#pragma once

// Map points of one window looked for in a keyframe of the other, where an alignment says they
// are: the paper's forward and reverse projection (section IV.D).

#include <Eigen/Core>
#include <vector>

#include "loop_verification/correspondences/point_observation.h"

namespace pangea {

// Of a corner on octave 0.
inline constexpr double kCornerSigma_px = 1.0;

// A point that should be seen in the keyframe.
struct Projection {
  int landmark = 0;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  bool found = false;
  // Seen from so near its host's viewpoint that it ought to be found, unless occluded.
  bool comparable = false;
};

struct SearchResult {
  std::vector<PointMatch> matches;  // by landmark, each landmark and each corner at most once
  std::vector<Projection> projections;
};

// `pose` is T_m_c and its covariance whatever the direction.
SearchResult SearchByProjection(const WindowPair& windows, Direction direction, int frame,
                                const PoseEstimate& pose);

// Nearest descriptors without any prediction: the newest keyframe's corners against the window's
// points. For a first guess; a third of these may be wrong.
std::vector<PointMatch> MatchByDescriptor(const WindowPair& windows, Direction direction,
                                          int max_hamming, double max_ratio);

}  // namespace pangea
