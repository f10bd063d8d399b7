#pragma once

// The messages between the server's modules, as domain types.

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "core/ids.h"
#include "core/rigid3.h"

namespace pangea {

enum class PlaceKind : int8_t {
  kIntra = 1,  // both keyframes are of one map, which is not fused with any other
  kInter = 2,  // any other pair of keyframes
  // Only constraints have this kind, no candidates: such a constraint replaces those whose
  // keyframes were thinned away (thinning/thinning.h).
  kDerived = 3,
  kTag = 4,  // both keyframes see an AprilTag with the same identity
};

struct PlaceCandidate {
  KeyframeId match;  // the older keyframe
  PlaceKind kind = PlaceKind::kInter;
  float score = 0;  // retrieval score, 0 .. 1
  // Pairs (corner of the query, corner of the match) that passed the epipolar check.
  std::vector<std::pair<int, int>> corner_matches;
};

// The result of place recognition for one keyframe; there is exactly one for each keyframe.
struct PlaceMatch {
  KeyframeId query;
  std::vector<PlaceCandidate> candidates;
  // For people: candidates that were dropped before publication, and why.
  std::vector<std::string> rejected;
};

// Constraint::reason of a candidate that was not verified, because constraints near it already
// determine the relative pose well. Its matched corners are still useful for bundle adjustment.
inline constexpr char kRedundant[] = "redundant";

inline int64_t ConstraintId(const KeyframeId& from, const KeyframeId& to, PlaceKind kind) {
  return static_cast<int64_t>(StableHash(from, to, static_cast<uint64_t>(kind)) >> 1);
}
// Of a candidate's verification result: known before there is a result.
inline int64_t ConstraintId(const KeyframeId& query, const PlaceCandidate& candidate) {
  return ConstraintId(candidate.match, query, candidate.kind);
}

// The verification result of a candidate; there is exactly one for each candidate.
struct Constraint {
  KeyframeId from;  // the candidate's match
  KeyframeId to;    // the query
  PlaceKind kind = PlaceKind::kInter;
  bool accepted = false;
  std::string reason;                          // why it was refused
  Rigid3 T_from_to;                            // between the two body frames
  Matrix6d covariance = Matrix6d::Identity();  // (translation, rotation) in from's body frame
  int num_inliers = 0;
  double inlier_ratio = 0;
  double rms_px = 0;

  int64_t Id() const { return ConstraintId(from, to, kind); }
};

// The drift of an agent's odometry: T_map_odom of one of its maps.
struct Correction {
  MapId map;
  int32_t seq = 0;  // newest keyframe of that map in the optimisation
  MapId group;      // the map whose odom frame is the group's map frame
  int64_t revision = 0;
  Rigid3 T_map_odom;
  Matrix6d covariance = Matrix6d::Identity();
};

struct KeyframePose {
  KeyframeId id;
  int64_t utime = 0;
  Rigid3 T_map_body;
};

// The optimised keyframe poses of one group. On the bus it is cut into several messages.
struct MapState {
  MapId group;
  int64_t revision = 0;
  std::vector<MapId> maps;
  int num_constraints = 0;
  int num_switched_off = 0;
  std::vector<KeyframePose> keyframes;
};

}  // namespace pangea
