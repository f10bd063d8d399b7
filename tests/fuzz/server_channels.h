#pragma once

// The input channels of the server's processes.

#include <vector>

#include "fuzz.h"
#include "messages/keyframe_message.h"
#include "pangea/again_t.hpp"
#include "pangea/anchor_edit_t.hpp"
#include "pangea/constraint_t.hpp"
#include "pangea/correction_t.hpp"
#include "pangea/have_t.hpp"
#include "pangea/map_state_t.hpp"
#include "pangea/place_match_t.hpp"
#include "pangea/pose_t.hpp"
#include "pangea/resend_request_t.hpp"
#include "pangea/verdict_request_t.hpp"

namespace pangea::fuzz {

inline const std::vector<Channel>& ServerChannels() {
  static const std::vector<Channel> channels = {
      ChannelOf<KeyframeMessage>("KEYFRAME_1"),
      ChannelOf<KeyframeMessage>("KEYFRAME_2"),
      ChannelOf<place_match_t>("PLACE_MATCH"),
      ChannelOf<constraint_t>("CONSTRAINT"),
      ChannelOf<map_state_t>("MAP_STATE"),
      ChannelOf<map_state_t>("REFINEMENT"),
      ChannelOf<have_t>("HAVE"),
      ChannelOf<resend_request_t>("RESEND_REQUEST"),
      ChannelOf<again_t>("AGAIN_posegraph"),
      ChannelOf<again_t>("AGAIN_place_recognition"),
      ChannelOf<again_t>("AGAIN_fusion"),
      ChannelOf<again_t>("AGAIN_global_ba"),
      ChannelOf<again_t>("AGAIN_map_points"),
      ChannelOf<pose_t>("POSE_1"),
      ChannelOf<verdict_request_t>("VERDICT_REQUEST"),
      ChannelOf<anchor_edit_t>("ANCHOR_EDIT"),
      ChannelOf<correction_t>("CORRECTION_1"),
      ChannelOf<again_t>("AGAIN_anchors"),
  };
  return channels;
}

}  // namespace pangea::fuzz
