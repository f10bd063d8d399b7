#pragma once

// What the server's modules tell each other, as domain types.

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "core/ids.h"
#include "core/rigid3.h"

namespace pangea {

enum class PlaceKind : int8_t {
  kIntra = 1,  // both keyframes of one map that is in no group with another
  kInter = 2,
  // No candidate has it: a constraint in the place of those whose keyframes were thinned away
  // (thinning/thinning.h).
  kDerived = 3,
};

struct PlaceCandidate {
  KeyframeId match;  // the older keyframe
  PlaceKind kind = PlaceKind::kInter;
  float score = 0;  // retrieval score, 0 .. 1
  // (query corner, match corner) that passed the epipolar check
  std::vector<std::pair<int, int>> corner_matches;
};

// Exactly one per keyframe.
struct PlaceMatch {
  KeyframeId query;
  std::vector<PlaceCandidate> candidates;
  std::vector<std::string> rejected;  // dropped before publication, and why: for people
};

// Why a candidate was not verified: constraints beside it tell the relative pose well enough. Its
// matched corners are good for bundle adjustment.
inline constexpr char kRedundant[] = "redundant";

// Exactly one per candidate.
struct Constraint {
  KeyframeId from;  // the candidate's match
  KeyframeId to;    // the query
  PlaceKind kind = PlaceKind::kInter;
  bool accepted = false;
  std::string reason;                          // why it was refused
  Rigid3 T_from_to;                            // bodies
  Matrix6d covariance = Matrix6d::Identity();  // (translation, rotation) in from's body frame
  int num_inliers = 0;
  double inlier_ratio = 0;
  double rms_px = 0;

  int64_t Id() const {
    return static_cast<int64_t>(StableHash(from, to, static_cast<uint64_t>(kind)) >> 1);
  }
};

// An agent's drift.
struct Correction {
  MapId map;
  int32_t seq = 0;  // newest keyframe of that map the solve knew
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

// One group's optimised keyframe poses; cut into chunks only on the wire.
struct MapState {
  MapId group;
  int64_t revision = 0;
  std::vector<MapId> maps;
  int num_constraints = 0;
  int num_switched_off = 0;
  std::vector<KeyframePose> keyframes;
};

}  // namespace pangea
