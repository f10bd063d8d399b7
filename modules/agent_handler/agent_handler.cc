#include "agent_handler/agent_handler.h"

#include "pangea/pose_t.hpp"

namespace pangea {
namespace {

// An uplink silent for this long may be replaced by one whose clock is behind.
constexpr int64_t kSilent_us = 3'000'000;
constexpr int64_t kAckSpacing_us = 4'000;
constexpr int64_t kAckDelay_us = 20'000;
constexpr int kAckPackets = 16;
constexpr int64_t kCorrectionRepeat_us = 300'000;
constexpr size_t kMaxReason = 300;
// Corrections are remembered for the newest submaps only; an agent drives one at a time.
constexpr size_t kMaxCorrections = kMaxLinkMaps;

std::string CheckKeyframe(const KeyframeId& id, Bytes bytes) {
  keyframe_t message{};
  if (!DecodeMessage(bytes, &message)) {
    return "keyframe_t does not decode";
  }
  const auto keyframe = Parse(message);
  if (!keyframe.value) {
    return keyframe.refused;
  }
  return keyframe.value->id == id ? "" : "keyframe under another's id";
}

}  // namespace

AgentHandler::AgentHandler(int32_t agent_id, int64_t run, const ReceiverOptions& options)
    : agent_id_(agent_id), run_(run), receiver_(options, CheckKeyframe) {}

void AgentHandler::Resume(const MapId& map, int32_t journalled_seq) {
  receiver_.Resume(map, journalled_seq);
}

std::string AgentHandler::OnPacket(const LinkPacket& packet, int64_t now_us) {
  if (std::string reason = CheckRun(packet, now_us); !reason.empty()) {
    return reason;
  }
  highest_number_ = std::max(highest_number_, packet.number);
  last_packet_us_ = now_us;
  ++packets_since_ack_;
  switch (packet.kind) {
    case LinkPacket::Kind::kHello:
      return OnHello(packet);
    case LinkPacket::Kind::kPose:
      return OnPose(packet);
    case LinkPacket::Kind::kKeyframe:
      return receiver_.Add(packet);
  }
  return "";
}

std::string AgentHandler::CheckRun(const LinkPacket& packet, int64_t now_us) {
  if (packet.run == uplink_run_) {
    return "";
  }
  const bool follows = packet.run > uplink_run_ || now_us - last_packet_us_ > kSilent_us;
  if (packet.kind != LinkPacket::Kind::kHello || !follows) {
    return "packet of another run of the uplink";
  }
  uplink_run_ = packet.run;
  highest_number_ = 0;
  return "";
}

std::string AgentHandler::OnHello(const LinkPacket& packet) {
  link_hello_t message{};
  if (!DecodeMessage(packet.data, &message)) {
    return "link_hello_t does not decode";
  }
  const auto hello = Parse(message);
  if (!hello.value) {
    return hello.refused;
  }
  for (const LinkMap& map : hello.value->maps) {
    if (map.map.agent_id != agent_id_) {
      return "hello with another agent's map";
    }
  }
  software_ = hello.value->software;
  receiver_.OnHello(*hello.value);
  for (const LinkMap& map : hello.value->maps) {
    const auto it = corrections_.find(map.map);
    if (it != corrections_.end()) {
      it->second.confirmed_revision = map.correction_revision;
    }
  }
  ack_urgent_ = true;
  return "";
}

std::string AgentHandler::OnPose(const LinkPacket& packet) {
  pose_t message{};
  if (!DecodeMessage(packet.data, &message)) {
    return "pose_t does not decode";
  }
  const auto map = Parse(message.map);
  if (!map.value || map.value->agent_id != agent_id_ || message.reason.size() > kMaxReason) {
    return "pose of another agent, or absurd";
  }
  const bool valid = Parse(message.T_odom_body).value && Parse(message.T_map_body).value;
  if (message.state == pose_t::STATE_TRACKING && !valid) {
    return "pose is no rigid transform";
  }
  pose_ = packet.data;
  return "";
}

void AgentHandler::Journalled(const KeyframeId& id) {
  receiver_.Journalled(id);
  ack_urgent_ = true;
}

void AgentHandler::OnCorrection(const Correction& correction) {
  Told& told = corrections_[correction.map];
  if (told.correction.revision < correction.revision) {
    told.correction = correction;
    ack_urgent_ = true;
  }
  if (corrections_.size() > kMaxCorrections) {
    corrections_.erase(corrections_.begin());
  }
}

// The newest submap's first: it is the one the agent is in.
const Correction* AgentHandler::Unconfirmed() const {
  for (auto it = corrections_.rbegin(); it != corrections_.rend(); ++it) {
    if (it->second.confirmed_revision < it->second.correction.revision) {
      return &it->second.correction;
    }
  }
  return nullptr;
}

std::optional<LinkAck> AgentHandler::TakeAck(int64_t now_us) {
  const int64_t since = now_us - last_ack_us_;
  const Correction* correction = Unconfirmed();
  const bool soon = ack_urgent_ || packets_since_ack_ >= kAckPackets;
  const bool due = (soon && since >= kAckSpacing_us) ||
                   (packets_since_ack_ > 0 && since >= kAckDelay_us) ||
                   (correction != nullptr && since >= kCorrectionRepeat_us);
  if (uplink_run_ == 0 || !due) {
    return std::nullopt;
  }
  LinkAck ack;
  ack.agent_id = agent_id_;
  ack.run = run_;
  ack.number = ++acks_;
  ack.uplink_run = uplink_run_;
  ack.highest_number = highest_number_;
  receiver_.FillAck(&ack);
  if (correction != nullptr) {
    ack.corrections.push_back(*correction);
  }
  last_ack_us_ = now_us;
  packets_since_ack_ = 0;
  ack_urgent_ = false;
  return ack;
}

}  // namespace pangea
