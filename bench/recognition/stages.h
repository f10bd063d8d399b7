#pragma once

// Place recognition and the two verifiers of its candidates run over keyframes in order, and every
// place looked at is followed through the four stages: retrieval, epipolar check, PnP, window BA.

#include <array>
#include <map>
#include <string>
#include <vector>

#include "bench/recognition/curve.h"
#include "core/keyframe.h"
#include "recording/trajectory.h"

namespace pangea::bench {

// Where a place is looked for.
enum class Search { kOwnMap, kOtherMaps };
inline constexpr std::array kSearches = {Search::kOwnMap, Search::kOtherMaps};
std::string ToString(Search search);

// A place looked at for a keyframe, and how far it came.
struct Retrieved {
  KeyframeId query, match;
  double overlap = 0;  // true (overlap.h)
  float score = 0;     // retrieval
  int epipolar_inliers = 0;
  bool verified = false;   // the epipolar check lets it pass
  bool published = false;  // and it is among the best of those
  int pnp_inliers = 0;
  int landmarks = 0;  // inliers of the window BA
  bool accepted = false;
  double error_m = 0;  // of the pose that the window BA found, if it has landmarks
  double error_rad = 0;

  bool right_pose() const;  // to 0.5 m and 5 degrees
};

struct Outcome {
  size_t keyframes = 0;  // with ground truth
  // Keyframes of which an earlier one truly shows the same, recent ones of their own map left out.
  std::map<Search, std::vector<KeyframeId>> with_overlap;
  std::vector<Retrieved> retrieved;
};

// `truth` is by agent, all of it in one frame; keyframes without a true pose are recognised but not
// counted.
Outcome RunStages(const std::vector<Keyframe>& keyframes,
                  const std::map<int32_t, Trajectory>& truth);

// What a stage says of those that came to it; `score`: retrieval score, or its inliers.
inline constexpr std::array kStages = {"retrieval", "epipolar", "PnP", "window BA"};
std::vector<Scored> AtStage(const Outcome& outcome, Search search, size_t stage);

}  // namespace pangea::bench
