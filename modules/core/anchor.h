#pragma once

// Anchors: an anchor is a named pose in the world, which all agents of a group see at one place.

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
  int64_t created_utime = 0;  // chosen by the maker, microseconds since 1970
  auto operator<=>(const AnchorId&) const = default;
};

// "2/1700000000000000": the same format as a MapId's.
std::string ToString(const AnchorId& id);

// What an editor's key allows the editor to do.
enum class AnchorRight : int8_t { kUnknown = 0, kRead = 1, kEditOwn = 2, kEditAll = 3 };

// Makes or changes an anchor. An edit states the whole anchor, not only what changed. The edit with
// the highest (revision, agent) wins, in any order of arrival; a deleted anchor stays deleted.
struct AnchorEdit {
  enum class Placement : int8_t {
    kSame = 1,      // the anchor stays where it is
    kKeyframe = 2,  // T_ref_anchor in the body frame of keyframe (map, keyframe_seq)
    kBody = 3,      // T_ref_anchor in the body frame of the agent at utime
    kPixel = 4,     // upright, on the surface behind `pixel` of the agent's image at utime
  };

  AnchorId anchor;
  int64_t revision = 1;
  int32_t agent_id = 0;  // who edits; 0: a tool on the server
  AnchorRight right = AnchorRight::kUnknown;
  int64_t seq = -1;  // number of the edit in the journal, from 0; -1: not journalled yet
  bool deleted = false;
  std::string name;     // at most kMaxAnchorName bytes; empty: RefusalOfNewEdit
  std::string payload;  // at most kMaxAnchorPayload bytes; only the apps interpret it
  Placement placement = Placement::kSame;
  MapId map;  // this field and those below are not read with kSame
  int32_t keyframe_seq = 0;
  int64_t utime = 0;  // sensor clock
  Rigid3 T_ref_anchor;
  // Pose of the agent at utime, by its own odometry. Without it the pose is interpolated between
  // two keyframes.
  std::optional<Rigid3> T_odom_body;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  // raw (distorted)
  std::optional<Matrix6d> covariance;               // of T_ref_anchor; none: not known
};

// Why an edit may not enter a journal, or an empty string. An anchor must have a name that people
// can read; journals of earlier versions also have other anchors.
std::string RefusalOfNewEdit(const AnchorEdit& edit);

// Whether two edits of one anchor with one revision change the same. Two tools on the server (agent
// 0) may use one revision for different edits; the journal has only the first.
bool IsSameChange(const AnchorEdit& a, const AnchorEdit& b);

inline constexpr size_t kMaxAnchorName = 50;
inline constexpr size_t kMaxAnchorPayload = 1000;

// The state of an anchor, for one agent or for the whole group.
struct AnchorState {
  AnchorId anchor;
  int64_t revision = 0;
  int32_t edited_by = 0;
  bool gone = false;  // deleted, no longer near the agent, or no longer in the group of `map`
  std::string name;
  std::string payload;
  MapId map;  // an agent's map; or the group's oldest map, whose odom frame is the map frame
  MapId group;
  int64_t group_revision = 0;  // 0: not optimised yet, the pose rests on the odometry alone
  Rigid3 T_odom_anchor;        // odom frame of `map`; valid near the agent's newest keyframe
  Matrix6d covariance = Matrix6d::Identity();
};

// The anchor's name; its id if it has none that a new edit may have.
std::string NameOf(const AnchorState& state);

struct ShownAnchor {
  AnchorId anchor;
  int64_t revision = 0;
  Rigid3 T_odom_anchor;
};

// The anchors that an app draws together with the agent's pose at `utime`.
struct ShownAnchors {
  int64_t utime = 0;
  MapId map;
  std::vector<ShownAnchor> anchors;
};

}  // namespace pangea
