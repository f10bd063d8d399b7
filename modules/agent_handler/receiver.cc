#include "agent_handler/receiver.h"

#include <algorithm>

namespace pangea {
namespace {

// In the order in which the sender has them under way (Sender::UnderWay).
bool GoesBefore(const KeyframeId& a, const KeyframeId& b) {
  return a.map == b.map ? a.seq < b.seq : b.map < a.map;
}

}  // namespace

Receiver::Receiver(const ReceiverOptions& options, Check check)
    : options_(options), check_(std::move(check)) {}

void Receiver::Resume(const MapId& map, int32_t journalled_seq) {
  maps_[map] = {journalled_seq + 1, journalled_seq, false, false, true};
}

void Receiver::OnHello(const LinkHello& hello) {
  // A map that brought nothing and is not named any more is forgotten: the number stays bounded.
  for (auto it = maps_.begin(); it != maps_.end();) {
    const auto& [id, map] = *it;
    const bool named = std::ranges::find(hello.maps, id, &LinkMap::map) != hello.maps.end();
    given_up_ -= map.brought || named ? 0 : map.next;
    it = map.brought || named ? std::next(it) : maps_.erase(it);
  }
  for (auto& [id, map] : maps_) {
    map.in_hello = false;
  }
  for (const LinkMap& announced : hello.maps) {
    ReceivedMap& map = maps_[announced.map];
    map.announced = map.in_hello = true;
    if (announced.first_seq > map.next && map.next == map.journalled + 1) {
      given_up_ += announced.first_seq - map.next;
      map.next = announced.first_seq;
      map.journalled = announced.first_seq - 1;
      auto it = cache_.lower_bound({announced.map, 0});
      while (it != cache_.end() && it->first < KeyframeId{announced.map, map.next}) {
        const auto passed = it++;
        Erase(passed);
      }
    }
  }
  // What waits for a map that is forgotten waits for nothing.
  for (auto it = cache_.begin(); it != cache_.end();) {
    const auto entry = it++;
    if (!maps_.contains(entry->first.map)) {
      Erase(entry);
    }
  }
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
  // The seq with this low byte that is nearest to the next one.
  const int32_t next = map->second.next;
  const KeyframeId id{map_id,
                      next + static_cast<int8_t>(piece.seq_low - static_cast<uint8_t>(next))};
  if (id.seq < next) {
    return "";  // a repeat of what is handed over already
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
      ++map.next;
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
    map->second.journalled = std::max(map->second.journalled, id.seq);
  }
}

void Receiver::FillAck(bool all_maps, LinkAck* ack) const {
  ack->cache_bytes = options_.cache_bytes;
  // What the uplink is sending, which is in its hello; then the newest maps.
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
