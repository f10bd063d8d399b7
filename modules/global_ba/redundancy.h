#pragma once

// Removes redundant keyframes from an adjustment: those nearly all of whose landmarks are seen by
// enough others (ORB-SLAM's rule: Mur-Artal et al., TRO 2015, section V.E). The preintegrations to
// and from a removed keyframe are joined to one if both exist, and so are the edges.
//
// Never removed are the ends of a constraint, a map's first or last keyframe, and a keyframe
// without which a span would be longer than kMaxGap_s: over more than a second the IMU constrains
// two keyframes poorly.

#include <vector>

#include "global_ba/ba_problem.h"

namespace pangea {

// Maximum time between successive keyframes that are kept.
inline constexpr double kMaxGap_s = 1.0;

// Whether a keyframe is removed.
enum class Cull { kIfRedundant, kNever, kAlways };

// The world without its redundant keyframes, tested in their order. `cull`: one entry per keyframe.
BaWorld WithoutRedundant(const BaWorld& world, const std::vector<Cull>& cull);

}  // namespace pangea
