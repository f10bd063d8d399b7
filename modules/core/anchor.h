#pragma once

// An anchor: a place in the world that people give a name, and see at the same place.

#include <Eigen/Core>
#include <compare>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/ids.h"
#include "core/rigid3.h"

namespace pangea {

struct AnchorId {
  int32_t agent_id = 0;       // who made it; 0: a tool on the server
  int64_t created_utime = 0;  // drawn by the maker, microseconds since 1970
  auto operator<=>(const AnchorId&) const = default;
};

// "2/1700000000000000", as a map's.
std::string ToString(const AnchorId& id);

// What the key of an editor allows.
enum class AnchorRight : int8_t { kUnknown = 0, kRead = 1, kEditOwn = 2, kEditAll = 3 };

// Makes an anchor, or changes one; it stands for the whole anchor. The highest (revision, agent)
// wins, whatever the order of arrival; an anchor that was deleted stays so.
struct AnchorEdit {
  enum class Placement : int8_t {
    kSame = 1,      // stays where it is
    kKeyframe = 2,  // T_ref_anchor in the body frame of keyframe (map, keyframe_seq)
    kBody = 3,      // T_ref_anchor in the body frame of the agent at utime
    kPixel = 4,     // the surface behind `pixel` in the agent's image of utime, upright
  };

  AnchorId anchor;
  int64_t revision = 1;
  int32_t agent_id = 0;  // who edits; 0: a tool on the server
  AnchorRight right = AnchorRight::kUnknown;
  int64_t seq = -1;  // in the journal, from 0; -1: not yet in it
  bool deleted = false;
  std::string name;     // at most kMaxAnchorName bytes
  std::string payload;  // at most kMaxAnchorPayload bytes, the apps' own
  Placement placement = Placement::kSame;
  MapId map;  // this and below: not read with kSame
  int32_t keyframe_seq = 0;
  int64_t utime = 0;  // sensor clock
  Rigid3 T_ref_anchor;
  // The agent's at utime, as its odometry had it then; else it lies between two keyframes.
  std::optional<Rigid3> T_odom_body;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  // raw
  std::optional<Matrix6d> covariance;               // of T_ref_anchor, where it is known
};

inline constexpr size_t kMaxAnchorName = 50;
inline constexpr size_t kMaxAnchorPayload = 1000;

// Where an anchor is, for those who show it.
struct AnchorState {
  AnchorId anchor;
  int64_t revision = 0;
  int32_t edited_by = 0;
  bool gone = false;  // deleted, or no longer in the group of `map`
  std::string name;
  std::string payload;
  MapId map;  // an agent's; or the group's, whose odom frame is the map frame
  MapId group;
  int64_t group_revision = 0;  // 0: none yet, the odometry alone
  Rigid3 T_odom_anchor;        // odom of `map`, valid around the agent's newest keyframe
  Matrix6d covariance = Matrix6d::Identity();
};

struct ShownAnchor {
  AnchorId anchor;
  int64_t revision = 0;
  Rigid3 T_odom_anchor;
};

// What an app draws with the pose of `utime`.
struct ShownAnchors {
  int64_t utime = 0;
  MapId map;
  std::vector<ShownAnchor> anchors;
};

}  // namespace pangea
