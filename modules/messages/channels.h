#pragma once

// All channel names are built here. docs/bus.md has a table of them.

#include <fmt/format.h>

#include <cstdint>
#include <string>
#include <string_view>

namespace pangea::channels {

inline constexpr std::string_view kPlaceMatch = "PLACE_MATCH";
inline constexpr std::string_view kConstraint = "CONSTRAINT";
inline constexpr std::string_view kMapState = "MAP_STATE";
inline constexpr std::string_view kRefinement = "REFINEMENT";
inline constexpr std::string_view kHave = "HAVE";
inline constexpr std::string_view kJournalFile = "JOURNAL_FILE";
inline constexpr std::string_view kJournalReplicated = "JOURNAL_REPLICATED";
inline constexpr std::string_view kResendRequest = "RESEND_REQUEST";
inline constexpr std::string_view kVerificationRequest = "VERDICT_REQUEST";
// Edits that are in the journal. Apps and tools ask for edits on kAnchorRequestPrefix.
inline constexpr std::string_view kAnchorEdit = "ANCHOR_EDIT";
// Anchors in their group's frame.
inline constexpr std::string_view kAnchor = "ANCHOR";
// Only in log files, never on a bus.
inline constexpr std::string_view kChecksums = "CHECKSUMS";
inline constexpr std::string_view kDamaged = "DAMAGED";

// LCM subscriptions are anchored regular expressions without grouping of alternatives.
inline constexpr std::string_view kAllKeyframes = "KEYFRAME_[0-9]+";
inline constexpr std::string_view kAllCorrections = "CORRECTION_[0-9]+";
inline constexpr std::string_view kAllLandmarks = "LANDMARKS_[0-9]+";
inline constexpr std::string_view kAllOthers = "OTHERS_[0-9]+";
inline constexpr std::string_view kAllAnchors = "ANCHOR_[0-9]+";
inline constexpr std::string_view kAllPoses = "POSE_[0-9]+";
inline constexpr std::string_view kAllImages = "IMAGE_[0-9]+";
inline constexpr std::string_view kAllLinkUps = "LINK_UP_[0-9]+";
inline constexpr std::string_view kAllLinkDowns = "LINK_DOWN_[0-9]+";
inline constexpr std::string_view kAllStatus = "STATUS_.*";
inline constexpr std::string_view kAllOptions = "OPTIONS_.*";

// Each agent has a channel of its own: the prefix and its id.
inline constexpr std::string_view kImuPrefix = "IMU_";
inline constexpr std::string_view kImagePrefix = "IMAGE_";
inline constexpr std::string_view kCameraPrefix = "CAMERA_";
inline constexpr std::string_view kPosePrefix = "POSE_";
inline constexpr std::string_view kKeyframePrefix = "KEYFRAME_";
inline constexpr std::string_view kCorrectionPrefix = "CORRECTION_";
inline constexpr std::string_view kLandmarksPrefix = "LANDMARKS_";
inline constexpr std::string_view kOthersPrefix = "OTHERS_";
inline constexpr std::string_view kAnchorPrefix = "ANCHOR_";
inline constexpr std::string_view kAnchorRequestPrefix = "ANCHOR_REQUEST_";
inline constexpr std::string_view kShownAnchorsPrefix = "SHOWN_ANCHORS_";
inline constexpr std::string_view kLinkUpPrefix = "LINK_UP_";
inline constexpr std::string_view kLinkDownPrefix = "LINK_DOWN_";
// Each process has a channel of its own: the prefix and its name.
inline constexpr std::string_view kStatusPrefix = "STATUS_";
inline constexpr std::string_view kAgainPrefix = "AGAIN_";
inline constexpr std::string_view kOptionsPrefix = "OPTIONS_";

inline std::string OfAgent(std::string_view prefix, int32_t agent_id) {
  return fmt::format("{}{}", prefix, agent_id);
}
inline std::string Imu(int32_t agent_id) { return OfAgent(kImuPrefix, agent_id); }
inline std::string Image(int32_t agent_id) { return OfAgent(kImagePrefix, agent_id); }
inline std::string Camera(int32_t agent_id) { return OfAgent(kCameraPrefix, agent_id); }
inline std::string Pose(int32_t agent_id) { return OfAgent(kPosePrefix, agent_id); }
inline std::string Keyframe(int32_t agent_id) { return OfAgent(kKeyframePrefix, agent_id); }
inline std::string Correction(int32_t agent_id) { return OfAgent(kCorrectionPrefix, agent_id); }
inline std::string Landmarks(int32_t agent_id) { return OfAgent(kLandmarksPrefix, agent_id); }
inline std::string Others(int32_t agent_id) { return OfAgent(kOthersPrefix, agent_id); }
inline std::string Anchor(int32_t agent_id) { return OfAgent(kAnchorPrefix, agent_id); }
// Agent 0 is a tool on the server's bus.
inline std::string AnchorRequest(int32_t agent_id) {
  return OfAgent(kAnchorRequestPrefix, agent_id);
}
inline std::string ShownAnchors(int32_t agent_id) { return OfAgent(kShownAnchorsPrefix, agent_id); }
inline std::string LinkUp(int32_t agent_id) { return OfAgent(kLinkUpPrefix, agent_id); }
inline std::string LinkDown(int32_t agent_id) { return OfAgent(kLinkDownPrefix, agent_id); }
inline std::string Status(std::string_view process) {
  return fmt::format("{}{}", kStatusPrefix, process);
}
inline std::string Options(std::string_view process) {
  return fmt::format("{}{}", kOptionsPrefix, process);
}
inline std::string Again(std::string_view process) {
  return fmt::format("{}{}", kAgainPrefix, process);
}

// The agent id in a channel name such as "KEYFRAME_7": the digits after `prefix`. 0 if the name has
// another form.
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
