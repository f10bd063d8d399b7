#pragma once

// Sets of point matches between two windows.

#include <array>
#include <vector>

#include "core/server_messages.h"
#include "loop_verification/correspondences/point_observation.h"

namespace pangea {

// A match of the two keyframes as it can be drawn: a point's corner in one, and in the other where
// the odometry has it; for matches found by projection how far the guess and the result miss it.
struct ShownMatch {
  Eigen::Vector2d pixel_m, pixel_c;
  bool inlier = false;
  double miss_before_px = 0;  // at PnP's pose
  double miss_after_px = 0;   // at the bundle adjustment's
};

// Those in the two keyframes themselves, none of their neighbours.
std::vector<ShownMatch> Shown(const WindowPair& windows, const std::vector<PointMatch>& matches,
                              const std::vector<bool>& inlier, const Rigid3& T_m_c_before,
                              const Rigid3& T_m_c_after);

// The candidate's matched corners that have a depth, in either keyframe or by their landmark in a
// neighbour.
std::vector<PointMatch> CandidateMatches(const WindowPair& windows,
                                         const PlaceCandidate& candidate);

// Each landmark and corner once.
std::vector<PointMatch> Distinct(const std::vector<PointMatch>& matches);

// Of the keyframes' votes on which landmark of the other window a landmark is, the majority stays;
// corners that are no landmark vote for nothing and stay.
std::vector<PointMatch> Agreeing(const WindowPair& windows, const std::vector<PointMatch>& matches);

// Those left and right of the middle one, across m's line of sight and level; T_m_c: windows.
std::array<std::vector<PointMatch>, 2> HalvesOfView(const WindowPair& windows,
                                                    const std::vector<PointMatch>& matches,
                                                    const Rigid3& T_m_c);

}  // namespace pangea
