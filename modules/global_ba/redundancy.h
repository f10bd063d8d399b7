#pragma once

// Keyframes that an adjustment can do without: nearly all of their landmarks are seen by enough
// others (ORB-SLAM's rule: Mur-Artal et al., TRO 2015, section V.E). What the IMU measured up to
// and from them becomes one span.
//
// Never the ends of a constraint, nor a map's first or last keyframe, nor one whose leaving makes a
// span longer than kMaxGap_s: over a second the IMU holds two keyframes together badly.

#include <vector>

#include "global_ba/ba_problem.h"

namespace pangea {

// Between keyframes that are kept.
inline constexpr double kMaxGap_s = 1.0;

// Whether a keyframe is to leave.
enum class Cull { kIfRedundant, kNever, kAlways };

// The world without its redundant keyframes, looked at in their order; `cull` has one entry a
// keyframe.
BaWorld WithoutRedundant(const BaWorld& world, const std::vector<Cull>& cull);

}  // namespace pangea
