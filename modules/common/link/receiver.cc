#include "common/link/receiver.h"

#include <algorithm>

namespace pangea {

Receiver::Receiver(const ReceiverOptions& options, Check check)
    : options_(options), check_(std::move(check)) {}

void Receiver::Resume(const MapId& map, int32_t journalled_seq) {
  maps_[map] = {journalled_seq + 1, journalled_seq};
}

void Receiver::OnHello(const LinkHello& hello) {
  // A map that brought nothing and is not named any more is forgotten: the number stays bounded.
  std::erase_if(maps_, [&](const auto& item) {
    return item.second.next == 0 &&
           std::none_of(hello.maps.begin(), hello.maps.end(),
                        [&](const auto& m) { return m.map == item.first; });
  });
  for (const LinkMap& announced : hello.maps) {
    Map& map = maps_[announced.map];
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

void Receiver::Erase(std::map<KeyframeId, Entry>::iterator it) {
  cached_bytes_ -= it->second.total_bytes;
  cache_.erase(it);
}

bool Receiver::MakeRoom(const KeyframeId& id, int bytes) {
  const auto full = [&] {
    return cached_bytes_ + bytes > options_.cache_bytes || cache_.size() >= kMaxPartialKeyframes;
  };
  while (full()) {
    if (cache_.empty() || std::prev(cache_.end())->first < id ||
        std::prev(cache_.end())->second.taken) {
      return false;
    }
    Erase(std::prev(cache_.end()));
  }
  return true;
}

Receiver::Entry* Receiver::FindOrStart(const LinkPacket& packet) {
  auto it = cache_.find(packet.keyframe);
  if (it != cache_.end()) {
    Entry& entry = it->second;
    if (entry.taken || (entry.crc32 == packet.crc32 && entry.count == packet.count &&
                        entry.total_bytes == packet.total_bytes)) {
      return &entry;
    }
    // Another cut or content of the same keyframe: the newer one counts, or a forged packet could
    // block the true ones for ever.
    Erase(it);
  }
  if (!MakeRoom(packet.keyframe, packet.total_bytes)) {
    return nullptr;
  }
  Entry& entry = cache_[packet.keyframe];
  entry.bytes.resize(static_cast<size_t>(packet.total_bytes));
  entry.received.resize(static_cast<size_t>(packet.count + 7) / 8);
  entry.crc32 = packet.crc32;
  entry.count = entry.missing = packet.count;
  entry.total_bytes = packet.total_bytes;
  cached_bytes_ += packet.total_bytes;
  return &entry;
}

std::string Receiver::Add(const LinkPacket& packet) {
  const KeyframeId& id = packet.keyframe;
  const auto map = maps_.find(id.map);
  if (map == maps_.end()) {
    return "packet of a map that was not announced";
  }
  if (id.seq < map->second.next) {
    return "";  // a repeat of what is handed over already
  }
  if (id.seq >= map->second.next + kMaxPartialKeyframes) {
    return "packet too far ahead";
  }
  Entry* entry = FindOrStart(packet);
  if (entry == nullptr) {
    return "receive cache full";
  }
  const auto index = static_cast<size_t>(packet.index);
  const auto bit = static_cast<uint8_t>(1 << (index % 8));
  if ((entry->received[index / 8] & bit) != 0) {
    return "";
  }
  std::copy(packet.data.begin(), packet.data.end(), entry->bytes.begin() + packet.offset);
  entry->received[index / 8] |= bit;
  if (--entry->missing > 0) {
    return "";
  }
  std::string reason = Complete(id, *entry);
  if (!reason.empty()) {
    Erase(cache_.find(id));
  }
  return reason;
}

std::string Receiver::Complete(const KeyframeId& id, const Entry& entry) {
  if (Crc32(entry.bytes) != entry.crc32) {
    return "keyframe's checksum is wrong";
  }
  return check_(id, entry.bytes);
}

std::vector<Receiver::Keyframe> Receiver::TakeReady() {
  std::vector<Keyframe> ready;
  for (auto& [map_id, map] : maps_) {
    auto it = cache_.find({map_id, map.next});
    while (it != cache_.end() && it->first == KeyframeId{map_id, map.next} &&
           it->second.missing == 0) {
      it->second.taken = true;
      ready.push_back({it->first, std::move(it->second.bytes)});
      ++map.next;
      ++it;
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

void Receiver::FillAck(LinkAck* ack) const {
  ack->cache_bytes = options_.cache_bytes;
  // The newest maps; and of those an uplink may still be sending none is older than its hello's.
  for (auto it = maps_.rbegin(); it != maps_.rend() && ack->journalled_seq.size() < kMaxAckMaps;
       ++it) {
    ack->journalled_seq[it->first] = it->second.journalled;
  }
  for (const auto& [id, entry] : cache_) {
    if (ack->partial.size() < kMaxPartialKeyframes) {
      ack->partial[id] = entry.received;
    }
  }
}

}  // namespace pangea
