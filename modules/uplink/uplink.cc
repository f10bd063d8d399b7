#include "uplink/uplink.h"

#include <algorithm>
#include <set>
#include <utility>

#include "link/anchor_wire.h"

namespace pangea {
namespace {

constexpr int64_t kSecond_us = 1'000'000;
// Without an acknowledgement for this long, the handler is away, and only hellos are sent.
constexpr int64_t kConnected_us = 3 * kSecond_us;
constexpr int64_t kHelloInterval_us = kSecond_us;
constexpr int64_t kHelloUrgent_us = kSecond_us / 4;
// How often the odometry is asked for missing keyframes, and for those beyond the newest known one.
constexpr int64_t kAskInterval_us = 3 * kSecond_us / 10;
constexpr int64_t kProbeInterval_us = kSecond_us;
constexpr int32_t kMaxAsked = 50;
// One probe would be enough for an odometry that opened a map while the uplink was away, but the
// odometry may be away itself.
constexpr int kMaxProbes = 3;
constexpr int64_t kProbeOthersInterval_us = kSecond_us / 5;
// A gap that the odometry has not filled after this many requests is lost for good.
constexpr int kMaxUnanswered = 30;
// An agent opens a map each time its odometry restarts. Beyond this number, the oldest finished
// maps are forgotten.
constexpr size_t kMaxMaps = 200;

// Size of a pose's packet on the wire, and the shares of a budget for poses and anchors.
constexpr double kPoseBytes = 180;
constexpr double kPoseShare = 0.05;
constexpr double kAnchorShare = 0.05;
constexpr double kMinBudget_kb_per_s = 5;  // bare keyframes alone take 3 kB/s

}  // namespace

std::optional<std::string> UplinkOptions::Invalid() const {
  if (budget_kb_per_s != 0 && !(budget_kb_per_s >= kMinBudget_kb_per_s)) {
    return "the budget must be at least 5 kB/s, or 0 for none";
  }
  return sender.Invalid();
}

UplinkOptions WithinBudget(UplinkOptions options) {
  if (const double budget_kb_per_s = options.budget_kb_per_s; budget_kb_per_s > 0) {
    options.sender.bandwidth_kb_per_s = std::min(options.sender.bandwidth_kb_per_s,
                                                 (1 - kPoseShare - kAnchorShare) * budget_kb_per_s);
    options.pose_hz = std::min(options.pose_hz, kPoseShare * 1000 * budget_kb_per_s / kPoseBytes);
  }
  return options;
}

double AnchorBytesPerSecond(const UplinkOptions& options) {
  const double budget = 1000 * options.budget_kb_per_s;
  return budget > 0 ? std::min(kAnchorBytesPerSecond, kAnchorShare * budget)
                    : kAnchorBytesPerSecond;
}

Uplink::Uplink(const UplinkOptions& options, Sender::Load load)
    : options_(WithinBudget(options)), sender_(options_.sender, std::move(load)) {}

void Uplink::SetStored(const KeyframeId& id) {
  OutgoingMap& map = FindOrAdd(id.map);
  map.highest = std::max(map.highest, id.seq);
  sender_.SetStored(id);
}

Uplink::OutgoingMap& Uplink::FindOrAdd(const MapId& id) {
  const auto [it, added] = maps_.try_emplace(id);
  if (added) {
    hello_due_ = true;
    for (auto old = maps_.begin(); maps_.size() > kMaxMaps && old != maps_.end();) {
      const bool done = old != it && old->first != current_ && sender_.spooled(old->first) == 0;
      if (done) {
        sender_.Forget(old->first);
      }
      old = done ? maps_.erase(old) : std::next(old);
    }
  }
  return it->second;
}

bool Uplink::NoteReceived(const KeyframeId& id, int64_t now_us) {
  OutgoingMap& map = FindOrAdd(id.map);
  map.received_us = now_us;
  map.probes = id.seq > map.highest ? 0 : map.probes;
  map.highest = std::max(map.highest, id.seq);
  return id.seq >= map.next && !sender_.Has(id);
}

Uplink::Taken Uplink::AddKeyframe(const KeyframeId& id, std::vector<uint8_t> bytes,
                                  int64_t now_us) {
  if (!NoteReceived(id, now_us)) {
    return Taken::kRepeat;
  }
  return sender_.Add(id, std::move(bytes)) ? Taken::kNew : Taken::kSpoolFull;
}

void Uplink::AddPose(const MapId& map_id, int64_t group_revision, std::vector<uint8_t> bytes) {
  pose_ = std::move(bytes);
  current_ = map_id;
  sender_.SetCurrent(map_id);
  // A pose makes the map known even if all its keyframes were missed.
  FindOrAdd(map_id).applied_revision = group_revision;
}

void Uplink::SetNext(const MapId& id, OutgoingMap* map, int32_t next) {
  map->next = std::max(next, map->given_up);
  map->highest = std::max(map->highest, map->next - 1);
  if (map->listed && map->slot) {
    sender_.SetNext(id, map->next);
  } else if (map->listed) {
    sender_.Release(id, map->next - 1);
  }
}

void Uplink::OnNewSession() {
  newest_ack_ = 0;
  last_ack_us_.reset();
  hello_due_ = true;
  for (auto& [id, map] : maps_) {
    map.listed = false;
  }
}

void Uplink::OnAck(const LinkAck& ack, int64_t now_us) {
  if (ack.number <= newest_ack_) {
    return;  // a newer acknowledgement came before
  }
  newest_ack_ = ack.number;
  last_ack_us_ = now_us;
  const size_t spooled = sender_.spooled();
  sender_.OnAck(ack, now_us);
  for (const auto& [id, seq] : ack.journalled_seq) {
    OutgoingMap& map = FindOrAdd(id);
    map.listed = true;
    SetNext(id, &map, seq + 1);
  }
  keyframes_acked_ += static_cast<int64_t>(spooled - sender_.spooled());
  for (const Correction& correction : ack.corrections) {
    OutgoingMap& map = FindOrAdd(correction.map);
    if (!map.correction || map.correction->revision < correction.revision) {
      map.correction = correction;
      map.sent_us = 0;
    }
    map.confirms = hello_due_ = true;
  }
}

bool Uplink::Connected(int64_t now_us) const {
  return last_ack_us_ && now_us - *last_ack_us_ < kConnected_us;
}

// The current map, and the newest of the other maps that have keyframes to send, or a correction to
// confirm.
std::vector<MapId> Uplink::Announced() const {
  std::vector<MapId> announced;
  if (maps_.empty()) {
    return announced;
  }
  announced.push_back(Current());
  for (auto it = maps_.rbegin(); it != maps_.rend() && announced.size() < kMaxLinkMaps; ++it) {
    const auto& [id, map] = *it;
    if (id != announced.front() && (sender_.spooled(id) > 0 || map.confirms)) {
      announced.push_back(id);
    }
  }
  std::reverse(announced.begin(), announced.end());
  return announced;
}

void Uplink::GiveSlots(const std::vector<MapId>& announced) {
  std::set<uint8_t> taken;
  std::vector<MapId> without;
  for (const MapId& id : announced) {
    const std::optional<uint8_t>& slot = maps_.at(id).slot;
    if (!slot || !taken.insert(*slot).second) {
      without.push_back(id);
    }
  }
  for (const MapId& id : without) {
    while (!taken.insert(next_slot_).second) {
      ++next_slot_;
    }
    OutgoingMap& map = maps_.at(id);
    map.slot = next_slot_++;
    SetNext(id, &map, map.next);
  }
}

// This happens when the journal knew the map before a hello of this run named it.
bool Uplink::LacksSlot() const {
  const std::vector<MapId> announced = Announced();
  return std::any_of(announced.begin(), announced.end(), [&](const MapId& id) {
    const OutgoingMap& map = maps_.at(id);
    return map.listed && !map.slot;
  });
}

std::vector<uint8_t> Uplink::Hello() {
  LinkHello hello;
  hello.software = OurSoftware();
  const std::vector<MapId> announced = Announced();
  GiveSlots(announced);
  for (const MapId& id : announced) {
    OutgoingMap& map = maps_.at(id);
    hello.maps.push_back(
        {id, map.given_up, map.correction ? map.correction->revision : 0, *map.slot});
    map.confirms = false;
  }
  return Encode(hello);
}

bool Uplink::HelloIsUrgent(int64_t now_us) const {
  const auto waits_for_listing = [&](const auto& item) {
    return !item.second.listed && sender_.spooled(item.first) > 0;
  };
  return !Connected(now_us) || hello_due_ ||
         std::any_of(maps_.begin(), maps_.end(), waits_for_listing);
}

std::vector<LinkPacket> Uplink::Poll(int64_t now_us) {
  std::vector<LinkPacket> packets;
  const int64_t since_hello = last_hello_us_ ? now_us - *last_hello_us_ : kHelloInterval_us;
  if (since_hello >= (HelloIsUrgent(now_us) ? kHelloUrgent_us : kHelloInterval_us) || LacksSlot()) {
    packets.push_back({LinkKind::kHello, sender_.NextNumber(now_us), Hello()});
    last_hello_us_ = now_us;
    hello_due_ = false;
  }
  if (!Connected(now_us)) {
    return packets;
  }
  const auto pose_interval_us =
      options_.pose_hz > 0 ? static_cast<int64_t>(1e6 / options_.pose_hz) : 0;
  if (!pose_.empty() && pose_interval_us > 0 && now_us - last_pose_us_ >= pose_interval_us) {
    packets.push_back({LinkKind::kPose, sender_.NextNumber(now_us), std::exchange(pose_, {})});
    last_pose_us_ = now_us;
  }
  for (Sender::Sent& sent : sender_.Poll(now_us)) {
    sent.piece.slot = *maps_.at(sent.keyframe.map).slot;
    packets.push_back({sent.piece.last ? LinkKind::kLastPiece : LinkKind::kPiece, sent.number,
                       Encode(sent.piece)});
  }
  return packets;
}

// The first gap of a map: seqs that were published but are neither acknowledged nor in the spool.
std::optional<SeqGap> Uplink::Missing(const MapId& id, const OutgoingMap& map) const {
  if (sender_.spooled(id) == map.highest + 1 - map.next) {
    return std::nullopt;  // no gap: the spool has all keyframes from `next` to `highest`
  }
  const int32_t from = sender_.FirstMissingFrom(id, map.next);
  if (from > map.highest) {
    return std::nullopt;
  }
  const auto present = sender_.FirstSeqFrom(id, from);
  return SeqGap{id, from, present ? *present - 1 : map.highest};
}

bool Uplink::GiveUp(const MapId& id, OutgoingMap* map, const SeqGap& gap) {
  const bool first = gap.from_seq == map->next;
  if (map->unanswered < kMaxUnanswered || !first || !map->listed || gap.to_seq >= map->highest) {
    return false;
  }
  keyframes_lost_ += gap.to_seq + 1 - map->next;
  map->given_up = gap.to_seq + 1;
  SetNext(id, map, map->given_up);
  map->unanswered = 0;
  hello_due_ = true;
  return true;
}

std::vector<Uplink::Ask> Uplink::Asks(int64_t now_us) {
  std::vector<Ask> asks;
  const bool full = sender_.Full();
  for (auto& [id, map] : maps_) {
    const bool current = id == Current();
    if (full || now_us - map.asked_us < kAskInterval_us) {
      continue;
    }
    auto gap = Missing(id, map);
    if (!gap && current && now_us - std::max(map.received_us, map.asked_us) > kProbeInterval_us) {
      // No keyframe is known to be missing. But after a restart, or if the last datagram was lost,
      // it would not be known. Usually there is no answer.
      map.asked_us = now_us;
      asks.push_back({{id, map.highest + 1, map.highest + kMaxAsked}, false});
      continue;
    }
    if (!gap) {
      map.unanswered = 0;
      continue;
    }
    map.unanswered = gap->from_seq == map.asked_from ? map.unanswered + 1 : 0;
    if (GiveUp(id, &map, *gap)) {
      continue;
    }
    map.asked_us = now_us;
    map.asked_from = gap->from_seq;
    gap->to_seq = std::min(gap->to_seq, gap->from_seq + kMaxAsked - 1);
    asks.push_back({*gap, true});
  }
  if (const auto gap = full ? std::nullopt : ProbeOthers(now_us)) {
    asks.push_back({*gap, false});
  }
  return asks;
}

std::optional<SeqGap> Uplink::ProbeOthers(int64_t now_us) {
  if (maps_.empty() || now_us - probed_others_us_ < kProbeOthersInterval_us) {
    return std::nullopt;
  }
  const auto probe = [&](const MapId& id, int32_t from_seq, int* probes) {
    ++*probes;
    probed_others_us_ = now_us;
    return SeqGap{id, from_seq, from_seq + kMaxAsked - 1};
  };
  for (auto it = maps_.rbegin(); it != maps_.rend(); ++it) {
    auto& [id, map] = *it;
    const bool due =
        id != Current() && now_us - std::max(map.received_us, map.asked_us) > kProbeInterval_us;
    if (map.probes < kMaxProbes && due && !Missing(id, map)) {
      map.asked_us = now_us;
      return probe(id, map.highest + 1, &map.probes);
    }
  }
  if (probes_of_start_ < kMaxProbes && now_us - probed_others_us_ > kProbeInterval_us) {
    return probe({maps_.begin()->first.agent_id, 0}, 0, &probes_of_start_);
  }
  return std::nullopt;
}

std::vector<Correction> Uplink::TakeCorrections(int64_t now_us) {
  std::vector<Correction> due;
  for (auto& [id, map] : maps_) {
    const bool applied = map.correction && map.applied_revision >= map.correction->revision;
    const bool current = id == Current();
    if (map.correction && !applied &&
        (map.sent_us == 0 || (current && now_us - map.sent_us >= kSecond_us))) {
      due.push_back(*map.correction);
      map.sent_us = now_us;
    }
  }
  return due;
}

std::map<MapId, int32_t> Uplink::Acknowledged() const {
  std::map<MapId, int32_t> acknowledged;
  for (const auto& [id, map] : maps_) {
    acknowledged[id] = map.next - 1;
  }
  return acknowledged;
}

}  // namespace pangea
