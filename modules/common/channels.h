#pragma once

// Channel names, built in this one place. docs/bus.md is their table.

#include <fmt/format.h>

#include <charconv>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>

namespace pangea::channels {

inline constexpr std::string_view kPlaceMatch = "PLACE_MATCH";
inline constexpr std::string_view kConstraint = "CONSTRAINT";
inline constexpr std::string_view kMapState = "MAP_STATE";
inline constexpr std::string_view kRefinement = "REFINEMENT";
inline constexpr std::string_view kHave = "HAVE";
inline constexpr std::string_view kResendRequest = "RESEND_REQUEST";
inline constexpr std::string_view kVerdictRequest = "VERDICT_REQUEST";

// LCM subscriptions are anchored regular expressions without grouping of alternatives.
inline constexpr std::string_view kAllKeyframes = "KEYFRAME_[0-9]+";
inline constexpr std::string_view kAllCorrections = "CORRECTION_[0-9]+";
inline constexpr std::string_view kAllLandmarks = "LANDMARKS_[0-9]+";
inline constexpr std::string_view kAllPoses = "POSE_[0-9]+";
inline constexpr std::string_view kAllStatus = "STATUS_.*";

inline std::string Imu(int32_t agent_id) { return fmt::format("IMU_{}", agent_id); }
inline std::string Image(int32_t agent_id) { return fmt::format("IMAGE_{}", agent_id); }
inline std::string Camera(int32_t agent_id) { return fmt::format("CAMERA_{}", agent_id); }
inline std::string Pose(int32_t agent_id) { return fmt::format("POSE_{}", agent_id); }
inline std::string Keyframe(int32_t agent_id) { return fmt::format("KEYFRAME_{}", agent_id); }
inline std::string Correction(int32_t agent_id) { return fmt::format("CORRECTION_{}", agent_id); }
inline std::string Landmarks(int32_t agent_id) { return fmt::format("LANDMARKS_{}", agent_id); }
inline std::string LinkUp(int32_t agent_id) { return fmt::format("LINK_UP_{}", agent_id); }
inline std::string LinkDown(int32_t agent_id) { return fmt::format("LINK_DOWN_{}", agent_id); }
// Whose LINK_UP_k it is.
inline std::optional<int32_t> LinkUpAgent(std::string_view channel) {
  constexpr std::string_view kPrefix = "LINK_UP_";
  int32_t agent_id = 0;
  const char* const end = channel.data() + channel.size();
  const bool named = channel.starts_with(kPrefix);
  const auto read = named ? std::from_chars(channel.data() + kPrefix.size(), end, agent_id)
                          : std::from_chars_result{nullptr, std::errc::invalid_argument};
  return read.ec == std::errc() && read.ptr == end ? std::optional(agent_id) : std::nullopt;
}
inline std::string Status(std::string_view process) { return fmt::format("STATUS_{}", process); }
inline std::string Again(std::string_view process) { return fmt::format("AGAIN_{}", process); }

// The agent of "KEYFRAME_7" and its like, by the digits after `prefix`; 0 if there is anything
// else.
inline int32_t AgentOf(std::string_view channel, std::string_view prefix) {
  if (!channel.starts_with(prefix) || channel.size() > prefix.size() + 5) {
    return 0;
  }
  int32_t id = 0;
  for (const char c : channel.substr(prefix.size())) {
    if (c < '0' || c > '9') {
      return 0;
    }
    id = 10 * id + (c - '0');
  }
  return id;
}

}  // namespace pangea::channels
