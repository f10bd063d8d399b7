#pragma once

// The input channels of the two ends of the link. Packets on the link are sealed, so a stranger's
// bytes fail at the first check. HELLO, PIECE, LANDMARKS, ... are bodies that a harness seals with
// the agent's key: messages that a compromised agent or server may send.

#include <vector>

#include "fuzz.h"
#include "link/wire.h"
#include "messages/keyframe_message.h"
#include "pangea/again_t.hpp"
#include "pangea/anchor_edit_t.hpp"
#include "pangea/anchor_t.hpp"
#include "pangea/constraint_t.hpp"
#include "pangea/correction_t.hpp"
#include "pangea/landmarks_t.hpp"
#include "pangea/others_t.hpp"
#include "pangea/place_match_t.hpp"
#include "pangea/pose_t.hpp"
#include "pangea/resend_request_t.hpp"
#include "pangea/verdict_request_t.hpp"

namespace pangea::fuzz {

inline const SecretKey& AgentKey() {
  static const SecretKey key({1, 2, 3});
  return key;
}

inline const std::vector<Channel>& HandlerChannels() {
  static const std::vector<Channel> channels = {
      {"LINK_UP_1", {}},
      {"HELLO", {}},
      {"PIECE", {}},
      {"LAST_PIECE", {}},
      {"POSE", {}},
      ChannelOf<place_match_t>("PLACE_MATCH"),
      ChannelOf<constraint_t>("CONSTRAINT"),
      ChannelOf<correction_t>("CORRECTION_1"),
      ChannelOf<resend_request_t>("RESEND_REQUEST"),
      ChannelOf<again_t>("AGAIN_agent_handler"),
      ChannelOf<landmarks_t>("LANDMARKS_1"),
      ChannelOf<verdict_request_t>("VERDICT_REQUEST"),
      ChannelOf<anchor_edit_t>("ANCHOR_EDIT_UP"),
      {"ANCHORS_RECEIVED", {}},
      ChannelOf<anchor_edit_t>("ANCHOR_REQUEST_0"),
      ChannelOf<anchor_t>("ANCHOR_1"),
  };
  return channels;
}

inline const std::vector<Channel>& UplinkChannels() {
  static const std::vector<Channel> channels = {
      {"LINK_DOWN_1", {}},
      {"ACK", {}},
      ChannelOf<KeyframeMessage>("KEYFRAME_1"),
      ChannelOf<pose_t>("POSE_1"),
      ChannelOf<again_t>("AGAIN_uplink_1"),
      ChannelOf<landmarks_t>("LANDMARKS"),
      {"ANCHOR_DOWN", {}},
      {"ANCHOR_EDIT_ANSWERS", {}},
      ChannelOf<anchor_edit_t>("ANCHOR_REQUEST_1"),
      ChannelOf<others_t>("OTHERS"),
  };
  return channels;
}

inline std::string ChannelOfKind(LinkKind kind) {
  switch (kind) {
    case LinkKind::kHello:
      return "HELLO";
    case LinkKind::kPiece:
      return "PIECE";
    case LinkKind::kLastPiece:
      return "LAST_PIECE";
    case LinkKind::kPose:
      return "POSE";
    case LinkKind::kLandmarks:
      return "LANDMARKS";
    case LinkKind::kOthers:
      return "OTHERS";
    case LinkKind::kAnchorEdit:
      return "ANCHOR_EDIT_UP";
    case LinkKind::kAnchorsReceived:
      return "ANCHORS_RECEIVED";
    case LinkKind::kAnchor:
      return "ANCHOR_DOWN";
    case LinkKind::kAnchorEditAnswers:
      return "ANCHOR_EDIT_ANSWERS";
    default:
      return "ACK";
  }
}

}  // namespace pangea::fuzz
