#pragma once

// The landmarks that a group's keyframes share.
//
// Within a map a landmark is a track of its odometry (landmark_id): seen where the tracker followed
// it, to a fraction of a pixel. Across maps and loops place_recognition's matched corners tie them:
// a landmark of one keyframe is seen at the matched corner of the other, as well as descriptors
// find a corner again (pixels). Two tracks that meet stay two landmarks: their corners may be
// neighbours on one object, and a landmark merged of both would bend two maps to a pixel's error.
//
// In: keyframes with their poses, matches between them. Out: landmarks triangulated from their own
// track's rays, and all their observations. Deterministic.

#include <memory>
#include <utility>
#include <vector>

#include "core/submap_store.h"
#include "global_ba/ba_problem.h"

namespace pangea {

// Of a tracked corner, and of a matched one at octave 0 (it grows by 1.2 with each octave).
inline constexpr double kTrackSigma_px = 0.5;
inline constexpr double kMatchSigma_px = 1.5;
// Of any ray from where its landmark is at first.
inline constexpr double kMaxStartSigmas = 10;

// Corners of two keyframes of the world that show the same.
struct MatchedKeyframes {
  int a = 0, b = 0;
  std::vector<std::pair<int, int>> corners;  // (of a, of b)
};

// Adds landmarks and observations to a world that has its keyframes, which `store` has too: one is
// looked at after the other, not all are held at once.
void AddLandmarks(const std::vector<MatchedKeyframes>& matches, SubmapStore* store, BaWorld* world);

}  // namespace pangea
