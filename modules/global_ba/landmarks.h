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

struct LandmarkOptions {
  double track_sigma_px = 0.5;
  double match_sigma_px = 1.5;   // at octave 0; grows by 1.2 with each octave
  double min_parallax = 0.02;    // radians between two rays of the track
  double max_start_sigmas = 10;  // of any ray from where it is at first

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("track_sigma_px", &track_sigma_px, {0.01, 20}, "px", "of a tracked corner");
    archive.Add("match_sigma_px", &match_sigma_px, {0.01, 20}, "px",
                "of a matched corner on octave 0");
    archive.Add("min_parallax", &min_parallax, {0, 3.15}, "rad", "between two rays of the track");
    archive.Add("max_start_sigmas", &max_start_sigmas, {0.1, 1000}, "",
                "of any ray from where the landmark is at first");
  }
};

// Corners of two keyframes of the world that show the same.
struct MatchedKeyframes {
  int a = 0, b = 0;
  std::vector<std::pair<int, int>> corners;  // (of a, of b)
};

// Adds landmarks and observations to a world that has its keyframes, which `store` has too: one is
// looked at after the other, not all are held at once.
void AddLandmarks(const std::vector<MatchedKeyframes>& matches, const LandmarkOptions& options,
                  SubmapStore* store, BaWorld* world);

}  // namespace pangea
