#pragma once

// Map points of one window looked for in a keyframe of the other, where an alignment says they
// are: the paper's forward and reverse projection (section IV.D).

#include <Eigen/Core>
#include <vector>

#include "loop_verification/correspondences/point_observation.h"

namespace pangea {

struct SearchOptions {
  double pixel_sigma = 1.0;  // of a corner on octave 0
  int max_hamming = kPredictedHamming;
  double max_ratio = 0.9;    // best to second-best distance, corners 4 px and further apart
  double max_chi2 = 11.8;    // within 3 sigma of the prediction (2 degrees of freedom)
  double min_radius_px = 4;  // of the search, whatever the prediction claims
  double max_radius_px = 40;
  double max_depth_m = 60;      // the deeper, the worse triangulated
  double max_view_angle = 0.9;  // radians between the two lines of sight
  double max_scale = 3.5;       // ratio of the two distances

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("pixel_sigma", &pixel_sigma, {0.01, 20}, "px", "of a corner on octave 0");
    archive.Add("max_hamming", &max_hamming, {0, kDescriptorBits}, "bits",
                "between descriptors that match");
    archive.Add("max_ratio", &max_ratio, {0.01, 1}, "", "best to second-best Hamming distance");
    archive.Add("max_chi2", &max_chi2, {0.1, 1000}, "",
                "of the distance to the prediction, 2 degrees of freedom");
    archive.Add("min_radius_px", &min_radius_px, {0, 1000}, "px", "of the search, at least");
    archive.Add("max_radius_px", &max_radius_px, {1, 1000}, "px", "of the search, at most");
    archive.Add("max_depth_m", &max_depth_m, {0.1, 10000}, "m", "of a point that is searched for");
    archive.Add("max_view_angle", &max_view_angle, {0.01, 3.15}, "rad",
                "between the two lines of sight");
    archive.Add("max_scale", &max_scale, {1, 100}, "", "ratio of the two distances");
  }
};

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
                                const PoseEstimate& pose, const SearchOptions& options);

// Nearest descriptors without any prediction: the newest keyframe's corners against the window's
// points. For a first guess; a third of these may be wrong.
std::vector<PointMatch> MatchByDescriptor(const WindowPair& windows, Direction direction,
                                          int max_hamming, double max_ratio);

}  // namespace pangea
