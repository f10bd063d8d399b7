#pragma once

// The server's half of the link, for one agent. It joins pieces to keyframes in a bounded receive
// cache (the paper, section IV.B, has 210 KiB), checks the keyframes, hands them over in seq order
// per map, and reports what it has. A state machine: no clock, no bus; not thread safe.
//
// A keyframe occupies the cache until it is journalled. When the cache is full, keyframes that the
// uplink sends first (of the current map, those with the lowest seqs) replace those that it sends
// last; a piece for which there is still no room is dropped. Whatever was dropped is sent again.

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "bus/retransmission/reorder_buffer.h"
#include "link/wire.h"

namespace pangea {

struct ReceiverOptions {
  // A lost piece holds back all later keyframes until it is repeated. This size lets 40 kB/s pass
  // at a round trip of 4 s and 20 % loss (link_test.cc).
  int cache_bytes = 1024 * 1024;
};

class Receiver {
 public:
  // Of one agent; each costs memory in every process of the server. One a minute for a week.
  static constexpr size_t kMaxMaps = 10'000;

  // Returns why a complete (compressed) message is not a valid keyframe with this id; empty if it
  // is.
  using Check = std::function<std::string(const KeyframeId&, Bytes)>;

  struct Keyframe {
    KeyframeId id;
    std::vector<uint8_t> bytes;
  };

  Receiver(const ReceiverOptions& options, Check check);

  // The journal already has this map up to `journalled_seq`, except for `gaps` (ascending). The
  // gaps are received first, until they are filled or given up.
  void Resume(const MapId& map, int32_t journalled_seq, const std::vector<SeqGap>& gaps = {});
  // Only maps that a hello has named are received. Keyframes that the uplink cannot deliver any
  // more are given up here, and counted. Returns why some maps are not received, or an empty
  // string.
  std::string OnHello(const LinkHello& hello);
  // In another run of the uplink, unfinished keyframes are dropped: they come again, and may be cut
  // into other pieces.
  void OnNewUplink();
  // Adds a piece of a keyframe of this map. Returns why it was refused, or an empty string; a
  // repeat is not refused.
  std::string Add(const MapId& map, const LinkPiece& piece);
  // The keyframes that are complete and next in their map, each once. Call Journalled for each when
  // it is on the disk.
  std::vector<Keyframe> TakeReady();
  void Journalled(const KeyframeId& id);

  // `all_maps`: also the maps that only the journal knows.
  void FillAck(bool all_maps, LinkAck* ack) const;

  // Number of keyframes in the cache: incomplete, or not yet journalled.
  size_t pending() const { return cache_.size(); }
  int64_t cached_bytes() const { return cached_bytes_; }
  int64_t given_up() const { return given_up_; }
  size_t num_maps() const { return maps_.size(); }

 private:
  struct ReceivedMap {
    int32_t next = 0;  // next seq to hand over
    int32_t journalled = -1;
    bool announced = false;  // a hello of this run of the uplink named it
    bool in_hello = false;   // the newest hello named it
    bool brought = false;    // it has ever had a keyframe
    std::map<int32_t, int32_t> runs =
        {};  // runs of keyframes after `next` that are journalled: first seq -> last seq

    // The first seq from `seq` on that the journal does not have.
    int32_t SkipRuns(int32_t seq) const;
    // Number of keyframes from `next` to before `seq` that the journal does not have.
    int32_t MissingBefore(int32_t seq) const;
  };
  struct Entry {
    std::vector<std::vector<uint8_t>> pieces;
    int count = 0;  // number of pieces; 0 until the last piece was received
    int present = 0;
    int64_t bytes = 0;
    bool taken = false;
    bool whole() const { return count > 0 && present == count; }
  };

  bool GoesBefore(const KeyframeId& a, const KeyframeId& b) const;
  bool MakeRoom(const KeyframeId& id, size_t bytes);
  // Of the keyframes not handed over yet, the one that the uplink sends last; end(): none.
  std::map<KeyframeId, Entry>::iterator Last();
  std::string Store(const KeyframeId& id, const LinkPiece& piece);
  static std::vector<uint8_t> Joined(const Entry& entry);
  void Erase(std::map<KeyframeId, Entry>::iterator it);

  const ReceiverOptions options_;
  Check check_;
  std::map<MapId, ReceivedMap> maps_;
  MapId current_;  // the last map of the newest hello: the agent is in it
  std::map<KeyframeId, Entry> cache_;
  int64_t cached_bytes_ = 0;
  int64_t given_up_ = 0;
};

}  // namespace pangea
