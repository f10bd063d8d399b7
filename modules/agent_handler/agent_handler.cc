#include "agent_handler/agent_handler.h"

#include <algorithm>

#include "link/compression.h"
#include "messages/encoding.h"

namespace pangea {
namespace {

constexpr int64_t kAckSpacing_us = 4'000;
constexpr int64_t kAckDelay_us = 20'000;
constexpr int kAckPieces = 16;
constexpr int64_t kCorrectionRepeat_us = 300'000;
// Corrections are kept only for the current map and the newest others.
constexpr size_t kMaxCorrections = kMaxLinkMaps;

// A repeat may differ, because a restarted uplink may have thinned the keyframe differently.
std::string CheckKeyframe(const KeyframeId& id, Bytes compressed, MapContinuity* continuity) {
  const auto bytes = Decompress(compressed, kMaxKeyframeBytes);
  if (!bytes) {
    return "keyframe does not decompress";
  }
  const auto keyframe = ParseMessage<KeyframeMessage>(*bytes);
  if (!keyframe.value) {
    return keyframe.refused;
  }
  return keyframe.value->id == id ? continuity->Check(*keyframe.value, 0)
                                  : "keyframe under another's id";
}

}  // namespace

AgentHandler::AgentHandler(int32_t agent_id, const ReceiverOptions& options)
    : agent_id_(agent_id),
      receiver_(options, [continuity = continuity_](const KeyframeId& id, Bytes bytes) {
        return CheckKeyframe(id, bytes, continuity.get());
      }) {}

void AgentHandler::Resume(const MapId& map, int32_t journalled_seq, const std::vector<SeqGap>& gaps,
                          const std::optional<Keyframe>& newest) {
  receiver_.Resume(map, journalled_seq, gaps);
  if (newest) {
    continuity_->Check(*newest, 0);
  }
}

void AgentHandler::OnNewUplink() {
  has_uplink_ = true;
  highest_number_ = 0;
  slots_.fill(std::nullopt);
  receiver_.OnNewUplink();
}

std::string AgentHandler::OnPacket(const LinkPacket& packet) {
  highest_number_ = std::max(highest_number_, packet.number);
  switch (packet.kind) {
    case LinkKind::kHello:
      return OnHello(packet);
    case LinkKind::kPose:
      return OnPose(packet);
    case LinkKind::kPiece:
    case LinkKind::kLastPiece:
      return OnPiece(packet);
    default:
      return "packet of an unknown kind";
  }
}

std::string AgentHandler::OnHello(const LinkPacket& packet) {
  const auto hello = ParseHello(agent_id_, packet.body);
  if (!hello.value) {
    return hello.refused;
  }
  software_ = hello.value->software;
  current_ = hello.value->maps.empty() ? MapId() : hello.value->maps.back().map;
  std::string refused = receiver_.OnHello(*hello.value);
  for (const LinkMap& map : hello.value->maps) {
    slots_[map.slot] = map.map;
    const auto it = corrections_.find(map.map);
    if (it != corrections_.end()) {
      it->second.confirmed_revision = map.correction_revision;
    }
  }
  hello_since_ack_ = true;
  return refused;
}

std::string AgentHandler::OnPiece(const LinkPacket& packet) {
  ++pieces_since_ack_;
  const auto piece = ParsePiece(packet);
  if (!piece.value) {
    return piece.refused;
  }
  const std::optional<MapId>& map = slots_[piece.value->slot];
  return map ? receiver_.Add(*map, *piece.value) : "piece of a map that was not announced";
}

std::string AgentHandler::OnPose(const LinkPacket& packet) {
  auto pose = ParsePose(agent_id_, packet.body);
  pose_ = std::move(pose.value);
  return pose.refused;
}

std::vector<Receiver::Keyframe> AgentHandler::TakeReady() {
  std::vector<Receiver::Keyframe> ready = receiver_.TakeReady();
  for (Receiver::Keyframe& keyframe : ready) {
    keyframe.bytes =
        *Decompress(keyframe.bytes, kMaxKeyframeBytes);  // valid: it was checked before
  }
  return ready;
}

void AgentHandler::Journalled(const KeyframeId& id) {
  receiver_.Journalled(id);
  ack_urgent_ = true;
}

void AgentHandler::OnCorrection(const Correction& correction) {
  SentCorrection& sent = corrections_[correction.map];
  if (sent.correction.revision < correction.revision) {
    sent.correction = correction;
    ack_urgent_ = true;
  }
  if (corrections_.size() > kMaxCorrections) {
    const auto oldest = corrections_.begin();
    corrections_.erase(oldest->first == current_ ? std::next(oldest) : oldest);
  }
}

// The current map comes first.
const Correction* AgentHandler::Unconfirmed() const {
  const Correction* newest = nullptr;
  for (const auto& [map, sent] : corrections_) {
    if (sent.confirmed_revision < sent.correction.revision) {
      newest = &sent.correction;
      if (map == current_) {
        break;
      }
    }
  }
  return newest;
}

std::optional<LinkAck> AgentHandler::TakeAck(int64_t now_us) {
  const int64_t since = now_us - last_ack_us_;
  const Correction* correction = Unconfirmed();
  const bool soon = ack_urgent_ || hello_since_ack_ || pieces_since_ack_ >= kAckPieces;
  const bool due = (soon && since >= kAckSpacing_us) ||
                   (pieces_since_ack_ > 0 && since >= kAckDelay_us) ||
                   (correction != nullptr && since >= kCorrectionRepeat_us);
  if (!has_uplink_ || !due) {
    return std::nullopt;
  }
  LinkAck ack;
  ack.highest_number = highest_number_;
  receiver_.FillAck(hello_since_ack_, &ack);
  if (correction != nullptr) {
    ack.corrections.push_back(*correction);
  }
  last_ack_us_ = now_us;
  pieces_since_ack_ = 0;
  hello_since_ack_ = false;
  ack_urgent_ = false;
  return ack;
}

}  // namespace pangea
