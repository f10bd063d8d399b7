#pragma once

// The agent's half of the link: keeps keyframes until they are acknowledged, cuts them into
// packets, paces them, and sends again what is missing. A state machine: time goes in, packets come
// out; no clock, no bus, one thread.
//
// In each map keyframes go out in seq order without gaps, so the other side never has to hold more
// than the few that are under way. What is lost is seen in the order of transmission numbers (a
// packet sent 24 numbers before one that arrived is gone), or after a time-out that follows the
// measured round trip (RFC 6298's estimator) and doubles with each try.
//
// Of several maps the newest goes first: what it brings is new to the server, and loops it closes
// are of use to the agent now. The history of older maps takes what room is left.
//
// Bounds: memory (options); beyond it new keyframes are refused: the oldest are the ones the pose
// chain hangs on, and the newest can still be asked from the odometry. Keyframes that are stored
// elsewhere (SetStored) are held in memory up to kMaxStoredInMemory only, and read again when their
// turn comes. In flight: options.

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
  // Keyframe bytes per packet: by default what fills one Ethernet frame; the paper has 4096.
  int payload_bytes = kFramePayloadBytes;
  double bandwidth_kb_per_s = 4000;  // keyframes' packets, repeats included, at most
  // Sent, neither arrived nor given up: what the receiver's cache takes (the paper, section IV.B).
  // A smaller window would hold keyframes back on a long way: at a round trip of 4 s 50 kB/s take
  // 200 kB.
  int max_in_flight_bytes = 210 * 1024;
  int64_t max_spool_bytes = 256 << 20;  // in memory; about 9,000 keyframes, an hour's walk
  // Why the options cannot be used, or nothing.
  std::optional<std::string> Invalid() const;
};

class Sender {
 public:
  static constexpr int64_t kMaxStoredInMemory = 8 << 20;
  // A stored keyframe, compressed; empty if it is lost.
  using Load = std::function<std::vector<uint8_t>(const KeyframeId&)>;

  explicit Sender(const SenderOptions& options, Load load = nullptr);

  // Takes a compressed keyframe. False if the spool is full.
  bool Add(const KeyframeId& id, std::vector<uint8_t> bytes);
  bool Has(const KeyframeId& id) const { return spool_.contains(id); }
  // It is stored from now on, and can be loaded; also one that an earlier run has stored.
  void SetStored(const KeyframeId& id);
  // The first spooled keyframe of the map at or after `seq`; the first seq that is none.
  std::optional<int32_t> FirstSeqFrom(const MapId& map, int32_t seq) const;
  int32_t FirstMissingFrom(const MapId& map, int32_t seq) const;
  // Only maps that the other side knows are sent, from this seq on; before it all is acknowledged.
  void SetNext(const MapId& map, int32_t next_seq);
  void Release(const MapId& map, int32_t journalled_seq);  // acknowledged up to this seq
  // The map is done with; nothing of it may be in the spool.
  void Forget(const MapId& map) { next_.erase(map); }

  void OnAck(const LinkAck& ack, int64_t now_us);
  struct Sent {
    int64_t number = 0;
    KeyframeId keyframe;
    LinkPiece piece;  // its slot is the caller's to fill in; valid until the next call
  };
  // The pieces due now. Call it every few milliseconds while there is something to send.
  std::vector<Sent> Poll(int64_t now_us);
  // The number of a packet of another kind, which is neither kept nor repeated. Its acknowledgement
  // measures the round trip too, so that the first keyframes already wait as long as they have to.
  int64_t NextNumber(int64_t now_us);

  size_t spooled() const { return spool_.size(); }
  int spooled(const MapId& map) const;
  // In memory.
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
    std::vector<uint8_t> bytes;  // empty while it is only stored
    bool stored = false;
    std::vector<Piece> pieces;  // empty until it is under way
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
  std::vector<KeyframeId> UnderWay() const;
  void SendPieces(const KeyframeId& id, Item* item, int64_t now_us, std::vector<Sent>* out);
  int PieceBytes(const Item& item, const Piece& piece) const;

  const SenderOptions options_;
  const Load load_;
  Pacer pacer_;
  std::map<KeyframeId, Item> spool_;
  std::map<MapId, int> spooled_of_;  // keyframes of each map that has any
  std::set<KeyframeId> started_;     // those with pieces
  std::map<MapId, int32_t> next_;
  int64_t spooled_bytes_ = 0;
  int in_flight_bytes_ = 0;
  int cache_bytes_ = 0;  // the receiver's
  int64_t last_number_ = 0;
  int64_t highest_acked_ = 0;
  int64_t resent_ = 0;
  std::deque<Transmission> recent_;  // at most kRecent, to measure the round trip
  double round_trip_us_ = 0;
  double round_trip_var_us_ = 0;
};

}  // namespace pangea
