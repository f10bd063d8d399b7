#pragma once

// Runs place recognition and the two verifiers on keyframes in order, and follows every place that
// was checked through the four stages: retrieval, epipolar check, PnP, window BA.

#include <array>
#include <map>
#include <string>
#include <vector>

#include "bench/recognition/curve.h"
#include "core/keyframe.h"
#include "recording/trajectory.h"

namespace pangea::bench {

// The maps in which a place is searched.
enum class Search { kOwnMap, kOtherMaps };
inline constexpr std::array kSearches = {Search::kOwnMap, Search::kOtherMaps};
std::string ToString(Search search);

// A place that was checked for a keyframe, and its results in the stages.
struct Retrieved {
  KeyframeId query, match;
  double overlap = 0;  // from ground truth (overlap.h)
  float score = 0;     // retrieval
  int epipolar_inliers = 0;
  bool verified = false;   // passed the epipolar check
  bool published = false;  // among the best that passed
  int pnp_inliers = 0;
  int landmarks = 0;  // inliers of the window BA
  bool accepted = false;
  double error_m = 0;  // error of the pose by the window BA, if landmarks > 0
  double error_rad = 0;

  bool right_pose() const;  // error below 0.5 m and 5 degrees
};

struct Outcome {
  size_t keyframes = 0;  // with ground truth
  // Keyframes with an earlier keyframe that truly overlaps, not counting recent ones of their own
  // map.
  std::map<Search, std::vector<KeyframeId>> with_overlap;
  std::vector<Retrieved> retrieved;
};

// `truth`: by agent, all in one frame. Keyframes without a true pose are recognised, but not
// counted.
Outcome RunStages(const std::vector<Keyframe>& keyframes,
                  const std::map<int32_t, Trajectory>& truth);

// The candidates that reached a stage, with its decision. `score`: retrieval score, or number of
// inliers.
inline constexpr std::array kStages = {"retrieval", "epipolar", "PnP", "window BA"};
std::vector<Scored> AtStage(const Outcome& outcome, Search search, size_t stage);

}  // namespace pangea::bench
