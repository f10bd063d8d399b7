#pragma once

// The server's half of the link, for one agent: puts pieces together to keyframes in a bounded
// receive cache (section IV.B: 210 KiB), checks them, hands them over in seq order per map, and
// says what it has. A state machine: no clock, no bus, one thread.
//
// A keyframe stays in the cache's account until it is journalled. Full cache: what the uplink sends
// first, of the newest map the lowest seqs, takes the room of what it sends last; a piece for which
// there is none is dropped. Both will be sent again.

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "bus/retransmission/reorder_buffer.h"
#include "link/wire.h"

namespace pangea {

struct ReceiverOptions {
  int cache_bytes = 210 * 1024;
};

class Receiver {
 public:
  // Why a complete (compressed) message is no valid keyframe of this id; empty if it is one.
  using Check = std::function<std::string(const KeyframeId&, Bytes)>;

  struct Keyframe {
    KeyframeId id;
    std::vector<uint8_t> bytes;
  };

  Receiver(const ReceiverOptions& options, Check check);

  // The journal already has this map up to `journalled_seq`, but for `gaps` (ascending): those are
  // taken first, until they are filled or given up.
  void Resume(const MapId& map, int32_t journalled_seq, const std::vector<SeqGap>& gaps = {});
  // Only maps of a hello (or of the journal) are received. What the uplink cannot deliver any more
  // is given up here, and counted.
  void OnHello(const LinkHello& hello);
  // Another run of the uplink: what is not whole comes again, and perhaps cut otherwise.
  void OnNewUplink();
  // A piece of a keyframe of this map; why it was refused, or an empty string (a repeat is no
  // fault).
  std::string Add(const MapId& map, const LinkPiece& piece);
  // The keyframes that are complete and next in their map, each once. Say when they are on disk.
  std::vector<Keyframe> TakeReady();
  void Journalled(const KeyframeId& id);

  // `all_maps`: also those that only the journal knows.
  void FillAck(bool all_maps, LinkAck* ack) const;

  // Keyframes in the cache: being put together, or not yet journalled.
  size_t pending() const { return cache_.size(); }
  int64_t cached_bytes() const { return cached_bytes_; }
  int64_t given_up() const { return given_up_; }
  size_t num_maps() const { return maps_.size(); }

 private:
  struct ReceivedMap {
    int32_t next = 0;  // to hand over
    int32_t journalled = -1;
    bool announced = false;  // by this run of the uplink
    bool in_hello = false;   // the newest one
    bool brought = false;    // a keyframe, ever
    std::map<int32_t, int32_t> runs =
        {};  // the journal has them beyond `next`: first seq, last seq

    // The first from `seq` on that the journal does not have.
    int32_t SkipRuns(int32_t seq) const;
    // Keyframes from `next` up to this one that the journal does not have.
    int32_t MissingBefore(int32_t seq) const;
  };
  struct Entry {
    std::vector<std::vector<uint8_t>> pieces;
    int count = 0;  // of pieces; known once the last one is there
    int present = 0;
    int64_t bytes = 0;
    bool taken = false;
    bool whole() const { return count > 0 && present == count; }
  };

  bool MakeRoom(const KeyframeId& id, size_t bytes);
  // Of those that are not on their way to the disk, the one the uplink sends last; end() for none.
  std::map<KeyframeId, Entry>::iterator Last();
  std::string Store(const KeyframeId& id, const LinkPiece& piece);
  static std::vector<uint8_t> Joined(const Entry& entry);
  void Erase(std::map<KeyframeId, Entry>::iterator it);

  const ReceiverOptions options_;
  Check check_;
  std::map<MapId, ReceivedMap> maps_;
  std::map<KeyframeId, Entry> cache_;
  int64_t cached_bytes_ = 0;
  int64_t given_up_ = 0;
};

}  // namespace pangea
