#pragma once

// The landmarks that a group's keyframes share.
//
// Within a map a landmark is a track of its odometry (landmark_id), observed with the accuracy of
// the tracker, a fraction of a pixel. Matched corners from place_recognition connect landmarks
// across maps and loops: a landmark of one keyframe is observed at the matched corner of the other,
// with the lower accuracy of descriptor matches (pixels). Two matched tracks remain two landmarks:
// their corners may be different points on one object, and one merged landmark would distort both
// maps.
//
// Input: keyframes with their poses, and matches between them. Output: landmarks, triangulated from
// the rays of their own track, and all their observations. Deterministic.

#include <memory>
#include <utility>
#include <vector>

#include "core/keyframe_store.h"
#include "global_ba/ba_problem.h"

namespace pangea {

// Sigma of a tracked corner, and of a matched one on octave 0 (it grows by 1.2 per octave).
inline constexpr double kTrackSigma_px = 0.5;
inline constexpr double kMatchSigma_px = 1.5;
// A ray further than this from its landmark's initial position is not used.
inline constexpr double kMaxStartSigmas = 10;

// Matched corners of keyframes a and b of the world.
struct MatchedKeyframes {
  int a = 0, b = 0;
  std::vector<std::pair<int, int>> corners;  // (of a, of b)
};

// Adds landmarks and observations to a world with keyframes. `store` has the same keyframes; they
// are read one after another, so that not all are in memory at once.
void AddLandmarks(const std::vector<MatchedKeyframes>& matches, KeyframeStore* store,
                  BaWorld* world);

}  // namespace pangea
