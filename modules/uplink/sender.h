#pragma once

// The agent's half of the link: it keeps keyframes until they are acknowledged, cuts them into
// packets, paces them, and sends lost packets again. A state machine: time goes in, packets come
// out; no clock, no bus; not thread safe.
//
// The keyframes of a map are sent in seq order without gaps, so the receiver holds only the few
// that are under way. A packet counts as lost if one sent 24 numbers later has arrived, or after a
// time-out, which follows the measured round trip (RFC 6298's estimator) and doubles with each try.
// If the round trip takes over a second, a lost packet is sent twice.
//
// Of several maps the current one is sent first, because its keyframes show new places, and its
// loop closures help the agent now. The others, by descending id, use the bandwidth that is left.
//
// Bounds: bytes in flight, and memory (SenderOptions). When the memory is full, new keyframes are
// refused, not old ones dropped: the chain of poses depends on the oldest, and the odometry can
// still resend the newest. Of keyframes that are also stored on disk (SetStored), only
// kMaxStoredInMemory bytes, or half of the bound if that is less, stay in memory; the others are
// loaded when they are sent.

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "link/pacer.h"
#include "link/wire.h"

namespace pangea {

struct SenderOptions {
  // Keyframe bytes per packet. By default a packet fills one Ethernet frame; the paper uses 4096.
  int payload_bytes = kFramePayloadBytes;
  double bandwidth_kb_per_s = 4000;  // at most, for keyframe packets and their repeats
  // Bytes sent and neither received nor lost: at most the size of the receiver's cache (the paper,
  // section IV.B). A smaller window would slow down links with a long round trip: 50 kB/s at 4 s
  // need 200 kB, and half as much again if a fifth of the packets is lost.
  int max_in_flight_bytes = 320 * 1024;
  int64_t max_spool_bytes = 256 << 20;  // in memory; about 9,000 keyframes, an hour of walking
  // Why the options cannot be used, or nothing.
  std::optional<std::string> Invalid() const;
};

class Sender {
 public:
  static constexpr int64_t kMaxStoredInMemory = 8 << 20;
  // Loads a stored keyframe, compressed; empty if it is lost.
  using Load = std::function<std::vector<uint8_t>(const KeyframeId&)>;

  explicit Sender(const SenderOptions& options, Load load = nullptr);

  // Adds a compressed keyframe. False if the memory is full.
  bool Add(const KeyframeId& id, std::vector<uint8_t> bytes);
  bool Has(const KeyframeId& id) const { return spool_.contains(id); }
  // The keyframe, compressed, if it is in memory; else empty.
  Bytes InMemory(const KeyframeId& id) const;
  // From now on the keyframe can be loaded with `load`; also used for those of an earlier run.
  void SetStored(const KeyframeId& id);
  // FirstSeqFrom: the first spooled keyframe of the map at or after `seq`. FirstMissingFrom: the
  // first seq at or after `seq` that is not spooled.
  std::optional<int32_t> FirstSeqFrom(const MapId& map, int32_t seq) const;
  int32_t FirstMissingFrom(const MapId& map, int32_t seq) const;
  // The handler knows the map: keyframes are sent from this seq on, earlier ones are acknowledged.
  // A map without SetNext is not sent.
  void SetNext(const MapId& map, int32_t next_seq);
  // The map that the odometry is in. Before the first call: the one with the highest id.
  void SetCurrent(const MapId& map) { current_ = map; }
  void Release(const MapId& map, int32_t journalled_seq);  // acknowledged up to this seq
  // The map is finished. None of its keyframes may be in the spool.
  void Forget(const MapId& map) { next_.erase(map); }

  void OnAck(const LinkAck& ack, int64_t now_us);
  struct Sent {
    int64_t number = 0;
    KeyframeId keyframe;
    LinkPiece piece;  // valid until the next call; the caller must set its slot
  };
  // The pieces to send now. Call it after each acknowledgement, every few milliseconds while
  // Paced(), and often enough for the time-outs while keyframes are spooled.
  std::vector<Sent> Poll(int64_t now_us);
  // Whether the last Poll left pieces because of the bandwidth.
  bool Paced() const { return paced_; }
  // The number for a packet of another kind, which the sender neither keeps nor repeats. Its
  // acknowledgement also measures the round trip, so the time-out is right from the first keyframe.
  int64_t NextNumber(int64_t now_us);

  size_t spooled() const { return spool_.size(); }
  int spooled(const MapId& map) const;
  // Bytes of keyframes in memory.
  int64_t spooled_bytes() const { return spooled_bytes_; }
  bool Full() const { return spooled_bytes_ + kMaxCompressedBytes > options_.max_spool_bytes; }
  int64_t resent() const { return resent_; }
  int in_flight_bytes() const { return in_flight_bytes_; }

 private:
  struct Piece {
    int64_t number = 0;  // of its last transmission
    int64_t sent_us = 0;
    int tries = 0;
    bool in_flight = false;
    bool received = false;
  };
  struct Item {
    std::vector<uint8_t> bytes;  // empty while the keyframe is only on disk
    bool stored = false;
    std::vector<Piece> pieces;  // empty until the keyframe is being sent
  };
  struct Transmission {
    int64_t number;
    int64_t sent_us;
  };

  Item& FindOrAdd(const KeyframeId& id);
  std::map<KeyframeId, Item>::iterator Erase(std::map<KeyframeId, Item>::iterator it);
  bool LoadBytes(const KeyframeId& id, Item* item);
  void Settle(const Item& item, Piece* piece);  // no longer in flight
  void MeasureRoundTrip(int64_t highest_number, int64_t now_us);
  void FindLost(int64_t highest_number, int64_t now_us);
  int64_t Timeout_us(int tries) const;
  int Copies(const Piece& piece) const;
  std::vector<KeyframeId> UnderWay() const;
  bool AddUnderWay(const KeyframeId& next, std::vector<KeyframeId>* ids, int64_t* bytes) const;
  void SendPieces(const KeyframeId& id, Item* item, int64_t now_us, std::vector<Sent>* out);
  int PieceBytes(const Item& item, const Piece& piece) const;

  const SenderOptions options_;
  const Load load_;
  Pacer pacer_;
  bool paced_ = false;
  std::map<KeyframeId, Item> spool_;
  std::map<MapId, int> spooled_of_;  // number of spooled keyframes of each map that has any
  std::set<KeyframeId> started_;     // those with pieces
  std::map<MapId, int32_t> next_;
  MapId current_;
  int64_t spooled_bytes_ = 0;
  int in_flight_bytes_ = 0;
  int cache_bytes_ = 0;  // size of the receiver's cache
  int64_t last_number_ = 0;
  int64_t highest_acked_ = 0;
  int64_t resent_ = 0;
  std::deque<Transmission> recent_;  // at most kRecent, to measure the round trip
  double round_trip_us_ = 0;
  double round_trip_var_us_ = 0;
};

}  // namespace pangea
