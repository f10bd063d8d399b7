#pragma once

// Sets of point matches between two windows.

#include <array>
#include <vector>

#include "core/server_messages.h"
#include "loop_verification/correspondences/point_observation.h"

namespace pangea {

// A match between the two keyframes, for drawing. The pixel of the observer is the corner; the
// pixel of the holder is the projection of the point by the odometry. The misses are the
// reprojection errors at two poses.
struct ShownMatch {
  Eigen::Vector2d pixel_m, pixel_c;
  bool inlier = false;
  double miss_before_px = 0;  // at PnP's pose
  double miss_after_px = 0;   // at the bundle adjustment's pose
};

// Returns only the matches observed in the two newest keyframes.
std::vector<ShownMatch> Shown(const WindowPair& windows, const std::vector<PointMatch>& matches,
                              const std::vector<bool>& inlier, const Rigid3& T_m_c_before,
                              const Rigid3& T_m_c_after);

// The candidate's matched corners with a depth: one in either keyframe, or that of their landmark
// in a neighbour.
std::vector<PointMatch> CandidateMatches(const WindowPair& windows,
                                         const PlaceCandidate& candidate);

// Removes repeats of the same landmark and corner.
std::vector<PointMatch> Distinct(const std::vector<PointMatch>& matches);

// Keyframes may match a landmark to different landmarks of the other window: keeps only the matches
// to the most frequent one. Matches to corners that are no landmark are kept.
std::vector<PointMatch> Agreeing(const WindowPair& windows, const std::vector<PointMatch>& matches);

// Splits the matches at the median of their horizontal position in m's view: left and right half.
// T_m_c: between the window frames.
std::array<std::vector<PointMatch>, 2> HalvesOfView(const WindowPair& windows,
                                                    const std::vector<PointMatch>& matches,
                                                    const Rigid3& T_m_c);

}  // namespace pangea
