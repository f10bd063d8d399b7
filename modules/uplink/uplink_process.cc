#include "uplink/uplink_process.h"

#include <fmt/format.h>

#include <cmath>
#include <functional>
#include <string_view>

#include "link/compression.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "pangea/again_t.hpp"
#include "pangea/have_t.hpp"
#include "pangea/others_t.hpp"
#include "pangea/pose_t.hpp"
#include "pangea/resend_request_t.hpp"
#include "uplink/thin.h"

namespace pangea {
namespace {

constexpr int64_t kHaveInterval_us = 400'000;
// Time for the first answer; later its lack is told, with the likely reasons.
constexpr int64_t kFirstAnswer_us = 5'000'000;
constexpr int kStoredAtOnce = 50;  // keyframes that the disk refused before
// Waits for the next Poll. A message ends them, so between keyframes only the hellos matter.
constexpr int kBusy_ms = 4;
constexpr int kTimeouts_ms = 20;
constexpr int kIdle_ms = 100;

size_t Checksum(Bytes data) {
  return std::hash<std::string_view>{}({reinterpret_cast<const char*>(data.data()), data.size()});
}

const char* KindForPeople(LinkKind kind) {
  switch (kind) {
    case LinkKind::kHello:
      return "hellos";
    case LinkKind::kPose:
      return "poses";
    case LinkKind::kAnchorEdit:
    case LinkKind::kAnchorsReceived:
      return "anchors";
    default:
      return "keyframes";
  }
}

}  // namespace

UplinkProcess::UplinkProcess(Bus& agent_bus, Bus& link_bus, int32_t agent_id, const SecretKey& key,
                             const UplinkOptions& options, Spool* spool, EditStore* edit_store)
    : agent_id_(agent_id),
      link_bus_(link_bus),
      node_(agent_bus, fmt::format("uplink_{}", agent_id)),
      session_(agent_id, key),
      spool_(spool),
      uplink_(options, [this](const KeyframeId& id) { return Load(id); }),
      anchors_(node_, agent_id, AnchorBytesPerSecond(options), edit_store) {
  node_.Watch(link_bus);
  if (options.budget_kb_per_s > 0) {
    ladder_.emplace(1000 * options.budget_kb_per_s);
  }
  if (spool_ != nullptr) {
    for (const KeyframeId& id : spool_->Kept()) {
      uplink_.SetStored(id);
    }
  }
  agent_bus.Subscribe(channels::Keyframe(agent_id),
                      [this](const std::string&, Bytes data) { OnKeyframe(data); });
  agent_bus.Subscribe(channels::Pose(agent_id),
                      [this](const std::string&, Bytes data) { OnPose(data); });
  link_bus.Subscribe(channels::LinkDown(agent_id),
                     [this](const std::string&, Bytes data) { OnLinkDown(data); });
  // If agent and server shared a bus, the server would get keyframes directly from the odometry,
  // before they are journalled.
  agent_bus.Subscribe(channels::Status("agent_handler"), [this](const std::string&, Bytes) {
    node_.Refuse("the server is on this bus too: give the agent's processes another one (--bus)");
  });
  node_.Subscribe<again_t>(channels::Again(node_.name()),
                           [this](const std::string&, const again_t& again) {
                             if (again.channel == channels::Keyframe(agent_id_)) {
                               node_.Count("keyframes_retransmitted");
                               OnKeyframe(again.data);
                             }
                           });
}

void UplinkProcess::OnKeyframe(Bytes data) {
  KeyframeMessage message{};
  if (data.size() > static_cast<size_t>(kMaxKeyframeBytes) || !DecodeMessage(data, &message)) {
    return node_.Refuse("keyframe does not decode, or is too large");
  }
  const auto keyframe = Parse(message);
  if (!keyframe.value) {
    return node_.Refuse(keyframe.refused);
  }
  if (keyframe.value->id.map.agent_id != agent_id_) {
    return node_.Refuse("another agent's keyframe");
  }
  if (const std::string reason = continuity_.Check(*keyframe.value, Checksum(data));
      !reason.empty()) {
    return node_.Refuse(reason);
  }
  if (!uplink_.NoteReceived(keyframe.value->id, now_us_)) {
    return node_.Count("keyframes_repeated");
  }
  anchors_.OnKeyframe(keyframe.value->utime, keyframe.value->id.map, keyframe.value->T_odom_body);
  const std::vector<uint8_t> bytes = FitBudget(*keyframe.value, data);
  std::vector<uint8_t> compressed = Compress(bytes);
  const auto compressed_bytes = static_cast<int64_t>(compressed.size());
  switch (uplink_.AddKeyframe(keyframe.value->id, std::move(compressed), now_us_)) {
    case Uplink::Taken::kNew:
      node_.Count("keyframe_bytes", compressed_bytes);
      if (ladder_) {
        ladder_->Charge(compressed_bytes);
      }
      if (spool_ != nullptr) {
        Store(keyframe.value->id, bytes);
      }
      return node_.Count("keyframes");
    case Uplink::Taken::kRepeat:
      return node_.Count("keyframes_repeated");
    case Uplink::Taken::kSpoolFull:
      return node_.Count("keyframes_spool_full");
  }
}

bool UplinkProcess::Store(const KeyframeId& id, Bytes bytes) {
  if (!spool_->Add(id, bytes, now_utime_)) {
    unstored_.insert(id);
    return false;
  }
  uplink_.SetStored(id);
  unstored_.erase(id);
  return true;
}

void UplinkProcess::StoreLeft() {
  bool stored = true;
  for (int i = 0; i < kStoredAtOnce && stored && !unstored_.empty(); ++i) {
    const KeyframeId id = *unstored_.begin();
    const Bytes compressed = uplink_.sender().InMemory(id);
    if (compressed.empty()) {
      unstored_.erase(id);  // it was acknowledged meanwhile
    } else {
      stored = Store(id, *Decompress(compressed, kMaxKeyframeBytes));
    }
  }
}

std::vector<uint8_t> UplinkProcess::FitBudget(const Keyframe& keyframe, Bytes data) {
  const size_t corners = keyframe.corners.size();
  if (ladder_) {
    const auto choice = ladder_->Next(now_us_, uplink_.sender().spooled_bytes());
    const Keyframe thin = choice.bare ? Bare(keyframe) : Thinned(keyframe, choice.untracked);
    if (thin.corners.size() < corners) {
      node_.Count(choice.bare ? "keyframes_bare" : "keyframes_thinned");
      node_.Count("corners_left_out", static_cast<int64_t>(corners - thin.corners.size()));
      return EncodeMessage(ToMessage(thin));
    }
  }
  return {data.begin(), data.end()};
}

std::vector<uint8_t> UplinkProcess::Load(const KeyframeId& id) {
  const std::vector<uint8_t> stored = spool_->Read(id);
  if (stored.empty()) {
    node_.Count("spool_reads_failed");
    return {};
  }
  return Compress(stored);
}

void UplinkProcess::OnPose(Bytes data) {
  pose_t message{};
  if (!DecodeMessage(data, &message)) {
    return node_.Refuse("pose_t does not decode");
  }
  const auto map = Parse(message.map);
  // While the odometry initialises, the pose has no map yet.
  if (map.value && map.value->agent_id == agent_id_) {
    uplink_.AddPose(*map.value, message.group_revision, EncodePose(message));
    const auto T_odom_body = Parse(message.T_odom_body).value;
    const bool tracks = message.state == pose_t::STATE_TRACKING;
    anchors_.OnPose(message.utime, *map.value, tracks ? T_odom_body : std::nullopt);
  }
}

void UplinkProcess::OnLinkDown(Bytes data) {
  const UplinkSession::Opened opened = session_.Open(data, uplink_.Connected(now_us_));
  if (!opened.refused.empty()) {
    return node_.Refuse(opened.refused);
  }
  if (opened.two_handlers) {
    node_.Refuse("a second server on this link bus has our key: end it, or give it another --link");
  }
  node_.Count("bytes_down", BytesOnTheWire(channels::LinkDown(agent_id_), data));
  if (opened.new_session) {
    uplink_.OnNewSession();
    anchors_.OnNewSession();
    last_others_ = 0;
  }
  if (!opened.packet) {
    return;
  }
  if (opened.packet->kind == LinkKind::kLandmarks) {
    return OnLandmarks(opened.packet->body);
  }
  if (opened.packet->kind == LinkKind::kOthers) {
    return OnOthers(*opened.packet);
  }
  if (UplinkAnchors::IsOfAnchors(opened.packet->kind)) {
    return anchors_.OnPacket(*opened.packet, now_us_);
  }
  if (opened.packet->kind != LinkKind::kAck) {
    return node_.Refuse("packet of an unknown kind");
  }
  const auto ack = ParseAck(agent_id_, *opened.packet);
  if (!ack.value) {
    return node_.Refuse(ack.refused);
  }
  uplink_.OnAck(*ack.value, now_us_);
}

void UplinkProcess::OnLandmarks(Bytes body) {
  landmarks_t message{};
  if (body.size() > size_t{kMaxLandmarksBytes} || !DecodeMessage(body, &message)) {
    return node_.Refuse("landmarks_t does not decode, or is too large");
  }
  const auto landmarks = Parse(message);
  if (!landmarks.value || landmarks.value->map.agent_id != agent_id_) {
    return node_.Refuse(landmarks.value ? "another agent's landmarks" : landmarks.refused);
  }
  node_.Publish(channels::Landmarks(agent_id_), message);
  node_.Count("landmark_messages");
}

void UplinkProcess::OnOthers(const LinkPacket& packet) {
  others_t message{};
  if (packet.body.size() > size_t{kMaxOthersBytes} || !DecodeMessage(packet.body, &message)) {
    return node_.Refuse("others_t does not decode, or is too large");
  }
  const auto others = Parse(message);
  if (!others.value || others.value->map.agent_id != agent_id_) {
    return node_.Refuse(others.value ? "others: for another agent" : others.refused);
  }
  if (packet.number > last_others_) {  // no newer one came before
    last_others_ = packet.number;
    node_.Publish(channels::Others(agent_id_), message);
  }
}

int64_t UplinkProcess::Send(const LinkPacket& packet) {
  const std::string channel = channels::LinkUp(agent_id_);
  const std::vector<uint8_t> bytes = session_.Seal(packet);
  link_bus_.Publish(channel, bytes);
  const int on_the_wire = BytesOnTheWire(channel, bytes);
  const char* const kind = KindForPeople(packet.kind);
  node_.Count("packets_up");
  node_.Count("bytes_up", on_the_wire);
  bytes_up_ += on_the_wire;
  node_.Count(fmt::format("packets_up_{}", kind));
  node_.Count(fmt::format("bytes_up_{}", kind), on_the_wire);
  return on_the_wire;
}

int UplinkProcess::Poll(int64_t steady_us) {
  now_us_ = steady_us;
  started_us_ = started_us_.value_or(steady_us);
  for (const LinkPacket& packet : uplink_.Poll(steady_us)) {
    Send(packet);
  }
  if (uplink_.Connected(steady_us)) {
    anchors_.SendDue(steady_us, [this](LinkKind kind, std::vector<uint8_t> body) {
      return Send({kind, uplink_.NextNumber(now_us_), std::move(body)});
    });
  }
  PublishHave();
  PublishAsks();
  PublishCorrections();
  anchors_.Publish(steady_us);
  if (uplink_.sender().Paced() || anchors_.moving()) {
    return kBusy_ms;
  }
  return num_waiting() > 0 || anchors_.edits_waiting() > 0 ? kTimeouts_ms : kIdle_ms;
}

void UplinkProcess::PublishHave() {
  std::map<MapId, int32_t> have = uplink_.Acknowledged();
  if (have == last_have_ && now_us_ < next_have_us_) {
    return;
  }
  have_t message{};
  for (const auto& [map, seq] : have) {
    if (spool_ != nullptr) {
      spool_->Release(map, seq);
    }
    if (seq >= 0) {
      message.maps.push_back(ToMessage(map));
      message.highest_seq.push_back(seq);
    }
  }
  message.num_maps = static_cast<int16_t>(message.maps.size());
  node_.Publish(std::string(channels::kHave), message);
  last_have_ = std::move(have);
  next_have_us_ = now_us_ + kHaveInterval_us;
}

void UplinkProcess::PublishAsks() {
  for (const auto& [gap, known] : uplink_.Asks(now_us_)) {
    resend_request_t request{};
    request.requester = node_.name();
    request.channel = channels::Keyframe(agent_id_);
    request.map = ToMessage(gap.map);
    request.from_seq = gap.from_seq;
    request.to_seq = gap.to_seq;
    node_.Publish(std::string(channels::kResendRequest), request);
    if (known) {
      node_.NoteResendAsked();
    }
  }
}

void UplinkProcess::PublishCorrections() {
  for (const Correction& correction : uplink_.TakeCorrections(now_us_)) {
    node_.Publish(channels::Correction(agent_id_), ToMessage(correction));
    node_.Count("corrections");
  }
}

std::string UplinkProcess::Totals() const {
  std::string text = fmt::format("{:.1f} kB sent; keyframes: {} acknowledged",
                                 1e-3 * static_cast<double>(bytes_up_), uplink_.keyframes_acked());
  if (num_waiting() > 0) {
    text += fmt::format(", {} {}", num_waiting(),
                        spool_ != nullptr ? "in the spool for the next start"
                                          : "lost: --spool FOLDER keeps them for the next start");
  }
  return text;
}

// Must be called once per second, because it also computes the rate.
std::string UplinkProcess::RateForPeople() {
  constexpr double kSmoothing = 0.1;
  const auto last_s = static_cast<double>(bytes_up_ - bytes_up_at_status_);
  bytes_up_at_status_ = bytes_up_;
  bytes_per_s_ += kSmoothing * (last_s - bytes_per_s_);
  node_.Set("bytes_up_per_s", std::llround(bytes_per_s_));
  if (!ladder_) {
    return "";
  }
  node_.Set("budget_bytes_per_s", std::llround(ladder_->budget_bytes_per_s()));
  node_.Set("rung", ladder_->rung());
  return fmt::format(", {:.1f} of {:.1f} kB/s, rung {} of {}", 1e-3 * bytes_per_s_,
                     1e-3 * ladder_->budget_bytes_per_s(), ladder_->rung(),
                     RateLadder::kNumRungs - 1);
}

void UplinkProcess::Tick(int64_t now_utime) {
  now_utime_ = now_utime;
  if (!node_.StatusIsDue(now_utime)) {
    return;
  }
  const Sender& sender = uplink_.sender();
  const int64_t spooled = num_waiting();
  const auto edits_waiting = static_cast<int64_t>(anchors_.edits_waiting());
  node_.Set("keyframes_acked", uplink_.keyframes_acked());
  node_.Set("keyframes_lost", uplink_.keyframes_lost());
  node_.Set("packets_resent", sender.resent());
  node_.Set("spool", spooled);
  node_.Set("anchor_edits_waiting", edits_waiting);
  node_.Set("spool_memory_bytes", sender.spooled_bytes());
  if (spool_ != nullptr) {
    StoreLeft();
    spool_->Sync();
    node_.Set("spool_disk_bytes", spool_->bytes());
    node_.Set("spool_damaged", spool_->num_damaged());
    node_.Set("spool_damaged_bytes", spool_->damaged_bytes());
  }
  anchors_.SyncSpool();
  node_.PublishStatus(
      now_utime, spooled + edits_waiting,
      fmt::format("{}, {} keyframes acknowledged, {} in the spool{}{}", StateForPeople(),
                  uplink_.keyframes_acked(), spooled, RateForPeople(), SpoolForPeople()));
}

// If the keys differ, the handler does not answer, so this is one of the reasons named here.
std::string UplinkProcess::StateForPeople() {
  if (uplink_.Connected(now_us_)) {
    was_connected_ = true;
    return "connected";
  }
  if (was_connected_) {
    return "handler is away";
  }
  if (now_us_ - started_us_.value_or(now_us_) < kFirstAnswer_us) {
    return "connecting";
  }
  return fmt::format("no answer yet: the handler is away, or its key for agent {} is not ours",
                     agent_id_);
}

std::string UplinkProcess::SpoolForPeople() const {
  if (spool_ == nullptr) {
    return "";
  }
  const bool refuses = spool_->refuses() || anchors_.spool_refuses();
  return std::string(refuses ? "; THE SPOOL'S DISK REFUSES WRITES" : "") +
         (spool_->num_damaged() > 0 ? "; THE SPOOL WAS DAMAGED, those files stay" : "");
}

}  // namespace pangea
