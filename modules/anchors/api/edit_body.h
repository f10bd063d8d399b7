#pragma once

// Parses the body of a request that makes or changes an anchor. ParseEditBody bounds every field.

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "core/anchor.h"

namespace pangea {

// The pose of an anchor: in the map frame of a group,
struct PoseInGroup {
  MapId group;
  Rigid3 T_map_anchor;
};
// or in the body frame of a keyframe,
struct PoseByKeyframe {
  KeyframeId keyframe;
  Rigid3 T_body_anchor;
};
// or on the surface that an agent's image shows there.
struct PoseBehindPixel {
  int32_t agent_id = 0;
  int64_t utime = 0;  // the agent's sensor clock
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
};
using BodyPose = std::variant<PoseInGroup, PoseByKeyframe, PoseBehindPixel>;

struct EditBody {
  std::optional<std::string> name;
  std::optional<std::string> payload;
  std::optional<int64_t> revision;  // the newest one that the editor knows
  std::optional<BodyPose> pose;
};

// An error in a request, for people.
struct BadField {
  std::string field;  // "pose.position"; empty for the body as a whole
  std::string error;  // including how to correct it
};

// `text`: JSON. A new anchor must have a pose and no revision; a change must have at least one
// field.
enum class BodyOf : uint8_t { kNew, kChange };
std::variant<EditBody, BadField> ParseEditBody(std::string_view text, BodyOf of);

// "2/1700000000000000".
std::optional<MapId> ParseMapId(std::string_view text);
std::optional<AnchorId> ParseAnchorId(std::string_view agent, std::string_view created);
// Only digits, 0 to `max`; else empty.
std::optional<int64_t> ParseNumber(std::string_view text, int64_t max);

}  // namespace pangea
