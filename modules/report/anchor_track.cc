#include "report/anchor_track.h"

#include <utility>

#include "messages/anchor_messages.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "pangea/pose_t.hpp"

namespace pangea {
namespace {

// The parsed message; empty if it does not parse.
template <typename Message>
auto Read(const LogEvent& event) -> decltype(Parse(Message()).value) {
  Message message{};
  if (!DecodeMessage(event.data, &message)) {
    return std::nullopt;
  }
  return std::move(Parse(message).value);
}

}  // namespace

AnchorTrackReader::AnchorTrackReader(int32_t agent_id)
    : pose_(channels::Pose(agent_id)),
      shown_channel_(channels::ShownAnchors(agent_id)),
      anchor_(channels::Anchor(agent_id)),
      request_(channels::AnchorRequest(agent_id)) {}

void AnchorTrackReader::Add(const LogEvent& event) {
  if (event.channel == pose_) {
    AddFrame(event);
  } else if (event.channel == shown_channel_) {
    if (auto shown = Read<shown_anchors_t>(event)) {
      shown_ = std::make_shared<const ShownAnchors>(std::move(*shown));
    }
  } else if (event.channel == anchor_) {
    if (const auto state = Read<anchor_t>(event)) {
      track_.heard[state->anchor].push_back(
          {event.utime, state->revision, state->gone, state->map, state->T_odom_anchor});
    }
  } else if (event.channel == request_) {
    if (auto edit = Read<anchor_edit_t>(event)) {
      track_.requests.insert_or_assign(edit->anchor, std::move(*edit));
    }
  }
}

void AnchorTrackReader::AddFrame(const LogEvent& event) {
  pose_t message{};
  if (!shown_ || !DecodeMessage(event.data, &message) || message.state != pose_t::STATE_TRACKING) {
    return;
  }
  const auto map = Parse(message.map);
  const auto T_odom_body = Parse(message.T_odom_body);
  if (map.value && T_odom_body.value) {
    track_.frames.push_back({message.utime, event.utime, *map.value, *T_odom_body.value, shown_});
  }
}

}  // namespace pangea
