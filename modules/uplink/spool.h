#pragma once

// Keyframes that are not acknowledged yet, on disk: hours without a server cost disk and not
// memory, and an uplink that is killed loses none.
//
// A folder of segments, ordinary LCM logs of KEYFRAME_k (keyframes_000001.lcm, ...), which are only
// appended to; one goes when all in it is acknowledged. Every run begins a segment of its own, so a
// tail torn by a crash is never written behind, and ignored. What the page cache has survives the
// process; Sync makes it survive a power cut.
//
// Bound: `max_bytes` of segments. Then, or when the disk refuses, Add says no, and the keyframe has
// to stay in memory. The index takes some 100 bytes of memory per keyframe. One thread.

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "bus/bus.h"
#include "core/ids.h"

namespace pangea {

class Spool {
 public:
  static constexpr int64_t kSegmentBytes = 16 << 20;
  // A segment that is read to its end is not removed before it has this size: else a connected
  // agent would make a file per keyframe.
  static constexpr int64_t kLeastSegmentBytes = 1 << 20;

  // Creates the folder, or finds what an earlier run left. Throws std::runtime_error: cannot be
  // used, in use by another process, another agent's.
  Spool(std::filesystem::path folder, int32_t agent_id, int64_t max_bytes);
  ~Spool();
  Spool(const Spool&) = delete;
  Spool& operator=(const Spool&) = delete;

  // An encoded keyframe_t; false if it was not written. A repeat changes nothing.
  bool Add(const KeyframeId& id, Bytes data, int64_t utime);
  // Empty if it is not there or cannot be read.
  std::vector<uint8_t> Read(const KeyframeId& id) const;
  // All of the map up to `seq` is acknowledged.
  void Release(const MapId& map, int32_t seq);
  void Sync();

  std::vector<KeyframeId> Kept() const;
  int64_t bytes() const { return bytes_; }
  // The last write was refused, by the disk or by the bound.
  bool refuses() const { return refuses_; }

 private:
  struct Segment {
    int64_t bytes = 0;
    int kept = 0;  // keyframes
  };
  struct Place {
    int64_t segment = 0;
    int64_t offset = 0;  // of the payload
    int32_t size = 0;
  };

  [[noreturn]] void Refuse(const std::string& reason) const;  // in the constructor
  std::filesystem::path File(int64_t segment) const;
  void Load(int64_t segment);
  bool Write(const KeyframeId& id, Bytes data, int64_t utime);
  void CloseFile();
  void RemoveIfRead(int64_t segment);

  const std::filesystem::path folder_;
  const int32_t agent_id_;
  const int64_t max_bytes_;
  int lock_ = -1;
  std::map<int64_t, Segment> segments_;
  std::map<KeyframeId, Place> places_;
  int64_t bytes_ = 0;
  int64_t newest_ = 0;  // segment
  int fd_ = -1;         // of the newest, while it is written to
  int64_t next_event_ = 0;
  bool unsynced_ = false;
  bool refuses_ = false;
};

}  // namespace pangea
