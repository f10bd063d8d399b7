#include "uplink/sender.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace pangea {
namespace {

// A packet this many numbers behind one that arrived counts as lost, not late.
constexpr int64_t kReordering = 24;
constexpr size_t kRecent = 512;
constexpr double kBurstBytes = 24'000;
// After this many tries a piece always waits for its time-out: the receiver probably refuses the
// keyframe.
constexpr int kQuickTries = 6;
constexpr double kMinTimeout_us = 100e3;
constexpr double kMaxTimeout_us = 10e6;
constexpr double kAckDelay_us = 50e3;
constexpr double kLongRoundTrip_us = 1e6;

}  // namespace

std::optional<std::string> SenderOptions::Invalid() const {
  if (payload_bytes < kMinPayloadBytes || payload_bytes > kMaxPayloadBytes) {
    return fmt::format("packet size must be {} .. {} bytes", kMinPayloadBytes, kMaxPayloadBytes);
  }
  if (!(bandwidth_kb_per_s >= 1)) {
    return "the bandwidth must be at least 1 kB/s";
  }
  if (max_in_flight_bytes < payload_bytes || max_spool_bytes < kMaxCompressedBytes) {
    return "window or spool is too small";
  }
  return std::nullopt;
}

Sender::Sender(const SenderOptions& options, Load load)
    : options_(options),
      load_(std::move(load)),
      pacer_(1000 * options.bandwidth_kb_per_s, kBurstBytes) {}

Sender::Item& Sender::FindOrAdd(const KeyframeId& id) {
  const auto [it, added] = spool_.try_emplace(id);
  spooled_of_[id.map] += added ? 1 : 0;
  return it->second;
}

bool Sender::Add(const KeyframeId& id, std::vector<uint8_t> bytes) {
  const auto size = static_cast<int64_t>(bytes.size());
  if (spooled_bytes_ + size > options_.max_spool_bytes) {
    return false;
  }
  if (!Has(id)) {
    FindOrAdd(id).bytes = std::move(bytes);
    spooled_bytes_ += size;
  }
  return true;
}

Bytes Sender::InMemory(const KeyframeId& id) const {
  const auto item = spool_.find(id);
  return item == spool_.end() ? Bytes() : Bytes(item->second.bytes);
}

void Sender::SetStored(const KeyframeId& id) {
  Item& item = FindOrAdd(id);
  item.stored = true;
  // Stored keyframes must leave room for new ones.
  const int64_t most = std::min(kMaxStoredInMemory, options_.max_spool_bytes / 2);
  if (item.pieces.empty() && spooled_bytes_ > most) {
    spooled_bytes_ -= static_cast<int64_t>(item.bytes.size());
    item.bytes = std::vector<uint8_t>();  // "= {}" would keep the memory
  }
}

bool Sender::LoadBytes(const KeyframeId& id, Item* item) {
  if (item->bytes.empty() && load_) {
    item->bytes = load_(id);
    spooled_bytes_ += static_cast<int64_t>(item->bytes.size());
  }
  return !item->bytes.empty();
}

std::optional<int32_t> Sender::FirstSeqFrom(const MapId& map, int32_t seq) const {
  const auto it = spool_.lower_bound({map, seq});
  if (it == spool_.end() || it->first.map != map) {
    return std::nullopt;
  }
  return it->first.seq;
}

int32_t Sender::FirstMissingFrom(const MapId& map, int32_t seq) const {
  for (auto it = spool_.find({map, seq}); it != spool_.end() && it->first == KeyframeId{map, seq};
       ++it) {
    ++seq;
  }
  return seq;
}

int Sender::spooled(const MapId& map) const {
  const auto it = spooled_of_.find(map);
  return it == spooled_of_.end() ? 0 : it->second;
}

void Sender::SetNext(const MapId& map, int32_t next_seq) {
  next_[map] = next_seq;
  Release(map, next_seq - 1);
}

int Sender::PieceBytes(const Item& item, const Piece& piece) const {
  const auto index = static_cast<int>(&piece - item.pieces.data());
  return static_cast<int>(pangea::Piece(item.bytes, options_.payload_bytes, index).size());
}

void Sender::Settle(const Item& item, Piece* piece) {
  if (piece->in_flight) {
    piece->in_flight = false;
    in_flight_bytes_ -= PieceBytes(item, *piece);
  }
}

void Sender::Release(const MapId& map, int32_t journalled_seq) {
  auto it = spool_.lower_bound({map, 0});
  while (it != spool_.end() && it->first.map == map && it->first.seq <= journalled_seq) {
    it = Erase(it);
  }
}

std::map<KeyframeId, Sender::Item>::iterator Sender::Erase(
    std::map<KeyframeId, Item>::iterator it) {
  for (Piece& piece : it->second.pieces) {
    Settle(it->second, &piece);
  }
  spooled_bytes_ -= static_cast<int64_t>(it->second.bytes.size());
  started_.erase(it->first);
  const auto of_map = spooled_of_.find(it->first.map);
  if (--of_map->second == 0) {
    spooled_of_.erase(of_map);
  }
  return spool_.erase(it);
}

void Sender::OnAck(const LinkAck& ack, int64_t now_us) {
  cache_bytes_ = ack.cache_bytes;
  MeasureRoundTrip(ack.highest_number, now_us);
  for (const KeyframeId& id : started_) {
    Item& item = spool_.at(id);
    const auto partial = ack.partial.find(id);
    for (size_t i = 0; i < item.pieces.size(); ++i) {
      // A received piece may be lost again: the receiver's cache may drop pieces before
      // journalling.
      item.pieces[i].received = partial != ack.partial.end() && i / 8 < partial->second.size() &&
                                ((partial->second[i / 8] >> (i % 8)) & 1) != 0;
      if (item.pieces[i].received) {
        Settle(item, &item.pieces[i]);
      }
    }
  }
  highest_acked_ = ack.highest_number;
}

void Sender::MeasureRoundTrip(int64_t highest_number, int64_t now_us) {
  while (!recent_.empty() && recent_.front().number < highest_number) {
    recent_.pop_front();
  }
  if (recent_.empty() || recent_.front().number != highest_number) {
    return;
  }
  const auto sample = static_cast<double>(now_us - recent_.front().sent_us);
  recent_.pop_front();
  if (round_trip_us_ == 0) {
    round_trip_us_ = sample;
    round_trip_var_us_ = sample / 2;
  } else {
    round_trip_var_us_ += 0.25 * (std::abs(sample - round_trip_us_) - round_trip_var_us_);
    round_trip_us_ += 0.125 * (sample - round_trip_us_);
  }
}

int64_t Sender::Timeout_us(int tries) const {
  const double estimate =
      round_trip_us_ == 0
          ? 1e6
          : std::max(kMinTimeout_us, round_trip_us_ + 4 * round_trip_var_us_ + kAckDelay_us);
  return static_cast<int64_t>(
      std::min(kMaxTimeout_us, estimate * std::pow(2.0, std::clamp(tries - 1, 0, 7))));
}

void Sender::FindLost(int64_t highest_number, int64_t now_us) {
  for (const KeyframeId& id : started_) {
    Item& item = spool_.at(id);
    for (Piece& piece : item.pieces) {
      const bool overtaken =
          piece.tries < kQuickTries && piece.number + kReordering <= highest_number;
      if (piece.in_flight && (overtaken || now_us - piece.sent_us > Timeout_us(piece.tries))) {
        Settle(item, &piece);
      }
    }
  }
}

// The keyframes to send: in each map those from the next seq up to the first gap, the current map
// first, as far as the receiver's cache can hold them.
std::vector<KeyframeId> Sender::UnderWay() const {
  std::vector<KeyframeId> ids;
  int64_t bytes = 0;
  const auto current = next_.find(current_);
  bool room = current == next_.end() || AddUnderWay({current_, current->second}, &ids, &bytes);
  for (auto newest = next_.rbegin(); room && newest != next_.rend(); ++newest) {
    room = newest->first == current_ || AddUnderWay({newest->first, newest->second}, &ids, &bytes);
  }
  return ids;
}

// Adds the keyframes of one map. False if there was not enough room.
bool Sender::AddUnderWay(const KeyframeId& next, std::vector<KeyframeId>* ids,
                         int64_t* bytes) const {
  KeyframeId id = next;
  for (auto it = spool_.find(id); it != spool_.end() && it->first == id; ++it, ++id.seq) {
    // A keyframe that is not loaded yet counts with the largest possible size.
    *bytes += it->second.bytes.empty() ? kMaxCompressedBytes
                                       : static_cast<int64_t>(it->second.bytes.size());
    if (!ids->empty() && (ids->size() >= kMaxPartialKeyframes || *bytes > cache_bytes_)) {
      return false;
    }
    ids->push_back(id);
  }
  return true;
}

std::vector<Sender::Sent> Sender::Poll(int64_t now_us) {
  std::vector<Sent> sent;
  pacer_.Refill(now_us);
  paced_ = false;
  FindLost(highest_acked_, now_us);
  for (const KeyframeId& id : UnderWay()) {
    const auto it = spool_.find(id);
    if (LoadBytes(id, &it->second)) {
      SendPieces(id, &it->second, now_us, &sent);
    } else {
      Erase(it);  // the odometry may still have it
    }
  }
  return sent;
}

// A repeat is sent twice if the round trip is long: a keyframe, and all after it, waits for the
// last of its pieces, and a third try would come seconds later.
int Sender::Copies(const Piece& piece) const {
  return piece.tries > 0 && round_trip_us_ > kLongRoundTrip_us ? 2 : 1;
}

void Sender::SendPieces(const KeyframeId& id, Item* item, int64_t now_us, std::vector<Sent>* out) {
  const int count = NumPieces(static_cast<int>(item->bytes.size()), options_.payload_bytes);
  item->pieces.resize(static_cast<size_t>(count));
  started_.insert(id);
  for (int i = 0; i < count; ++i) {
    Piece& piece = item->pieces[static_cast<size_t>(i)];
    if (piece.received || piece.in_flight) {
      continue;
    }
    const Bytes data = pangea::Piece(item->bytes, options_.payload_bytes, i);
    const auto size = static_cast<int>(data.size());
    paced_ = !pacer_.Ready();
    if (paced_ || in_flight_bytes_ + size > options_.max_in_flight_bytes) {
      return;
    }
    const int copies = Copies(piece);
    resent_ += piece.tries > 0 ? copies : 0;
    piece = {0, now_us, piece.tries + 1, true, false};
    in_flight_bytes_ += size;
    for (int copy = 0; copy < copies; ++copy) {
      piece.number = NextNumber(now_us);
      pacer_.Take(size);
      out->push_back(
          {piece.number, id, {0, static_cast<uint8_t>(id.seq), i, i == count - 1, data}});
    }
  }
}

int64_t Sender::NextNumber(int64_t now_us) {
  recent_.push_back({++last_number_, now_us});
  if (recent_.size() > kRecent) {
    recent_.pop_front();
  }
  return last_number_;
}

}  // namespace pangea
