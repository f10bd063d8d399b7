#include "agent_handler/receiver.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

namespace pangea {

Receiver::Receiver(const ReceiverOptions& options, Check check)
    : options_(options), check_(std::move(check)) {}

// The order in which the sender sends keyframes (Sender::UnderWay).
bool Receiver::GoesBefore(const KeyframeId& a, const KeyframeId& b) const {
  if (a.map == b.map) {
    return a.seq < b.seq;
  }
  return a.map == current_ || (b.map != current_ && b.map < a.map);
}

int32_t Receiver::ReceivedMap::SkipRuns(int32_t seq) const {
  const auto after = runs.upper_bound(seq);
  return after == runs.begin() ? seq : std::max(seq, std::prev(after)->second + 1);
}

int32_t Receiver::ReceivedMap::MissingBefore(int32_t seq) const {
  int32_t missing = seq - next;
  for (const auto& [first, last] : runs) {
    missing -= std::max(0, std::min(last + 1, seq) - std::max(first, next));
  }
  return missing;
}

void Receiver::Resume(const MapId& map_id, int32_t journalled_seq,
                      const std::vector<SeqGap>& gaps) {
  const int32_t next = gaps.empty() ? journalled_seq + 1 : gaps.front().from_seq;
  ReceivedMap map{next, next - 1, false, false, true};
  for (size_t i = 0; i < gaps.size(); ++i) {
    const int32_t last = i + 1 < gaps.size() ? gaps[i + 1].from_seq - 1 : journalled_seq;
    map.runs[gaps[i].to_seq + 1] = last;
  }
  maps_[map_id] = std::move(map);
}

std::string Receiver::OnHello(const LinkHello& hello) {
  current_ = hello.maps.empty() ? MapId() : hello.maps.back().map;
  // A map without keyframes that the hello no longer names is forgotten, which bounds their number.
  for (auto it = maps_.begin(); it != maps_.end();) {
    const auto& [id, map] = *it;
    const bool named = std::ranges::find(hello.maps, id, &LinkMap::map) != hello.maps.end();
    given_up_ -= map.brought || named ? 0 : map.next;
    it = map.brought || named ? std::next(it) : maps_.erase(it);
  }
  for (auto& [id, map] : maps_) {
    map.in_hello = false;
  }
  std::string refused;
  for (const LinkMap& announced : hello.maps) {
    if (!maps_.contains(announced.map) && maps_.size() >= kMaxMaps) {
      refused = fmt::format(
          "hello: agent {} has {} maps already, and no more are taken: give it another id "
          "(pangea-agent-handler keygen)",
          announced.map.agent_id, maps_.size());
      continue;
    }
    ReceivedMap& map = maps_[announced.map];
    map.announced = map.in_hello = true;
    if (announced.first_seq > map.next && map.next == map.journalled + 1) {
      given_up_ += map.MissingBefore(announced.first_seq);
      map.next = map.SkipRuns(announced.first_seq);
      map.journalled = map.next - 1;
      auto it = cache_.lower_bound({announced.map, 0});
      while (it != cache_.end() && it->first < KeyframeId{announced.map, map.next}) {
        const auto passed = it++;
        Erase(passed);
      }
    }
  }
  // Drop the cached keyframes of forgotten maps.
  for (auto it = cache_.begin(); it != cache_.end();) {
    const auto entry = it++;
    if (!maps_.contains(entry->first.map)) {
      Erase(entry);
    }
  }
  return refused;
}

void Receiver::OnNewUplink() {
  for (auto& [id, map] : maps_) {
    map.announced = false;
  }
  for (auto it = cache_.begin(); it != cache_.end();) {
    const auto entry = it++;
    if (!entry->second.taken) {
      Erase(entry);
    }
  }
}

void Receiver::Erase(std::map<KeyframeId, Entry>::iterator it) {
  cached_bytes_ -= it->second.bytes;
  cache_.erase(it);
}

bool Receiver::MakeRoom(const KeyframeId& id, size_t bytes) {
  const auto full = [&] {
    return cached_bytes_ + static_cast<int64_t>(bytes) > options_.cache_bytes ||
           (!cache_.contains(id) && cache_.size() >= kMaxPartialKeyframes);
  };
  while (full()) {
    const auto last = Last();
    if (last == cache_.end() || !GoesBefore(id, last->first)) {
      return false;
    }
    Erase(last);
  }
  return true;
}

std::map<KeyframeId, Receiver::Entry>::iterator Receiver::Last() {
  auto last = cache_.end();
  for (auto it = cache_.begin(); it != cache_.end(); ++it) {
    if (!it->second.taken && (last == cache_.end() || GoesBefore(last->first, it->first))) {
      last = it;
    }
  }
  return last;
}

std::string Receiver::Add(const MapId& map_id, const LinkPiece& piece) {
  const auto map = maps_.find(map_id);
  if (map == maps_.end() || !map->second.announced) {
    return "piece of a map that was not announced";
  }
  // The full seq with this low byte that is nearest to the next seq.
  const int32_t next = map->second.next;
  const KeyframeId id{map_id,
                      next + static_cast<int8_t>(piece.seq_low - static_cast<uint8_t>(next))};
  if (id.seq < next || map->second.SkipRuns(id.seq) != id.seq) {
    return "";  // a repeat of a keyframe that was already handed over
  }
  if (id.seq >= next + kMaxPartialKeyframes) {
    return "piece too far ahead";
  }
  const auto index = static_cast<size_t>(piece.index);
  const auto found = cache_.find(id);
  if (found != cache_.end()) {
    const Entry& entry = found->second;
    if (entry.taken || (index < entry.pieces.size() && !entry.pieces[index].empty())) {
      return "";
    }
    if ((entry.count > 0 && piece.index >= entry.count) ||
        (piece.last && index + 1 < entry.pieces.size())) {
      Erase(found);
      return "piece does not fit its keyframe";
    }
  }
  if (!MakeRoom(id, piece.data.size())) {
    return "receive cache full";
  }
  return Store(id, piece);
}

std::string Receiver::Store(const KeyframeId& id, const LinkPiece& piece) {
  Entry& entry = cache_[id];
  const auto index = static_cast<size_t>(piece.index);
  entry.pieces.resize(std::max(entry.pieces.size(), index + 1));
  entry.pieces[index].assign(piece.data.begin(), piece.data.end());
  entry.bytes += static_cast<int64_t>(piece.data.size());
  cached_bytes_ += static_cast<int64_t>(piece.data.size());
  entry.count = piece.last ? piece.index + 1 : entry.count;
  ++entry.present;
  std::string reason;
  if (entry.bytes > kMaxCompressedBytes) {
    reason = "keyframe is too large";
  } else if (entry.whole()) {
    reason = check_(id, Joined(entry));
  }
  if (!reason.empty()) {
    Erase(cache_.find(id));
  }
  return reason;
}

std::vector<uint8_t> Receiver::Joined(const Entry& entry) {
  std::vector<uint8_t> bytes;
  bytes.reserve(static_cast<size_t>(entry.bytes));
  for (const std::vector<uint8_t>& piece : entry.pieces) {
    bytes.insert(bytes.end(), piece.begin(), piece.end());
  }
  return bytes;
}

std::vector<Receiver::Keyframe> Receiver::TakeReady() {
  std::vector<Keyframe> ready;
  for (auto& [id, entry] : cache_) {
    ReceivedMap& map = maps_.at(id.map);
    if (id.seq == map.next && entry.whole()) {
      entry.taken = true;
      ready.push_back({id, Joined(entry)});
      map.next = map.SkipRuns(map.next + 1);
      map.brought = true;
    }
  }
  return ready;
}

void Receiver::Journalled(const KeyframeId& id) {
  const auto it = cache_.find(id);
  if (it != cache_.end()) {
    Erase(it);
  }
  const auto map = maps_.find(id.map);
  if (map != maps_.end()) {
    const int32_t known_to = map->second.SkipRuns(id.seq + 1) - 1;
    map->second.journalled = std::max(map->second.journalled, known_to);
  }
}

void Receiver::FillAck(bool all_maps, LinkAck* ack) const {
  ack->cache_bytes = options_.cache_bytes;
  // First the maps in the newest hello, which the uplink is sending; then the newest other maps.
  for (const bool in_hello : {true, false}) {
    for (auto it = maps_.rbegin(); it != maps_.rend() && ack->journalled_seq.size() < kMaxAckMaps;
         ++it) {
      if (it->second.in_hello == in_hello && (all_maps || it->second.announced)) {
        ack->journalled_seq[it->first] = it->second.journalled;
      }
    }
  }
  for (const auto& [id, entry] : cache_) {
    if (ack->partial.size() < kMaxPartialKeyframes && ack->journalled_seq.contains(id.map)) {
      std::vector<uint8_t>& received = ack->partial[id];
      received.resize((entry.pieces.size() + 7) / 8);
      for (size_t i = 0; i < entry.pieces.size(); ++i) {
        received[i / 8] |= static_cast<uint8_t>(entry.pieces[i].empty() ? 0 : 1 << (i % 8));
      }
    }
  }
}

}  // namespace pangea
