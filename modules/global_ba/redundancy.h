#pragma once

// Keyframes that an adjustment can do without: nearly all of their landmarks are seen by enough
// others (ORB-SLAM's rule: Mur-Artal et al., TRO 2015, section V.E). What the IMU measured up to
// and from them becomes one span.
//
// Never the ends of a constraint, nor a map's first or last keyframe, nor one whose leaving makes a
// span longer than max_gap_s: over a second the IMU holds two keyframes together badly.

#include <vector>

#include "global_ba/ba_problem.h"

namespace pangea {

struct RedundancyOptions {
  double share = 0.9;  // of a keyframe's landmarks
  int observers = 3;   // other keyframes that see one
  double max_gap_s = 1.0;

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("share", &share, {0, 1}, "", "of a redundant keyframe's landmarks that others see");
    archive.Add("observers", &observers, {1, 1000}, "", "other keyframes that see one");
    archive.Add("max_gap_s", &max_gap_s, {0, 1000}, "s", "between keyframes that are kept");
  }
};

// Whether a keyframe is to leave.
enum class Cull { kIfRedundant, kNever, kAlways };

// The world without its redundant keyframes, looked at in their order; `cull` has one entry a
// keyframe.
BaWorld WithoutRedundant(const BaWorld& world, const std::vector<Cull>& cull,
                         const RedundancyOptions& options);

}  // namespace pangea
