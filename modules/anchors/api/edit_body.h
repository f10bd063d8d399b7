#pragma once

// What a request's body says an anchor shall be. Past ParseEditBody every field is bounded.

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "core/anchor.h"

namespace pangea {

// Where an anchor is to be: in the map frame of a group,
struct PoseInGroup {
  MapId group;
  Rigid3 T_map_anchor;
};
// in the body frame of a keyframe,
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
  std::optional<int64_t> revision;  // that the editor knows
  std::optional<BodyPose> pose;
};

// What is wrong with a request, for people.
struct BadField {
  std::string field;  // "pose.position"; empty for the body as a whole
  std::string error;  // with how to mend it
};

// `text`: JSON. Of a new anchor the pose is needed and there is no revision; of a change there is
// at least one field.
enum class BodyOf : uint8_t { kNew, kChange };
std::variant<EditBody, BadField> ParseEditBody(std::string_view text, BodyOf of);

// "2/1700000000000000".
std::optional<MapId> ParseMapId(std::string_view text);
std::optional<AnchorId> ParseAnchorId(std::string_view agent, std::string_view created);
// Digits alone, 0 to `max`.
std::optional<int64_t> ParseNumber(std::string_view text, int64_t max);

}  // namespace pangea
