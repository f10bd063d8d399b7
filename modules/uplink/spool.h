#pragma once

// Keyframes that are not acknowledged yet, on disk: hours without a server cost disk and not
// memory, and an uplink that is killed loses none.
//
// A folder of segments, ordinary LCM logs of KEYFRAME_k (keyframes_000001.lcm, ...), which are only
// appended to; one goes when all in it is acknowledged. Every run begins a segment of its own, so a
// tail torn by a crash is never written behind, and ignored. What the page cache has survives the
// process; Sync makes it survive a power cut.
//
// A CHECKSUMS event (checksums.h) behind each keyframe shows when it is read whether it is still
// what was written. What is damaged costs no other keyframe; a segment with damage is not removed
// when its time has come, but kept under another name (keyframes_000001.lcm.damaged-<UTC time>)
// until somebody takes it away.
//
// Bound: `max_bytes` of segments, those with damage included. Then, or when the disk refuses, Add
// says no, and the keyframe has to stay in memory. The index takes some 100 bytes of memory per
// keyframe. One thread.

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "bus/bus.h"
#include "core/ids.h"
#include "log_file/checked_scan.h"

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
  // Empty if it is not there, or is damaged: then it is not kept any more.
  std::vector<uint8_t> Read(const KeyframeId& id);
  // All of the map up to `seq` is acknowledged.
  void Release(const MapId& map, int32_t seq);
  void Sync();

  std::vector<KeyframeId> Kept() const;
  int64_t bytes() const { return bytes_; }
  // Of segments with damage that are done with.
  int64_t damaged_bytes() const { return damaged_bytes_; }
  // Pieces that are no events, and keyframes that are not what was written, since the start.
  int64_t num_damaged() const { return num_damaged_; }
  // The last write was refused, by the disk or by the bound.
  bool refuses() const { return refuses_; }

 private:
  struct Segment {
    int64_t bytes = 0;
    int kept = 0;  // keyframes
    bool damaged = false;
  };
  struct Place {
    int64_t segment = 0;
    int64_t offset = 0;  // of the event
    int32_t size = 0;
    uint32_t crc32 = 0;
  };

  [[noreturn]] void Refuse(const std::string& reason) const;  // in the constructor
  std::filesystem::path File(int64_t segment) const;
  void FindFiles();
  void Load(int64_t segment);
  void LoadFrom(int fd, int64_t segment);
  void LoadEvent(int64_t segment, const CheckedScan::Piece& event);
  void NoteDamage(int64_t segment, const std::string& what);
  bool Write(const KeyframeId& id, Bytes data, int64_t utime);
  std::vector<uint8_t> ReadData(const Place& place) const;
  void CloseFile();
  void RemoveIfRead(int64_t segment);
  void Remove(int64_t segment);

  const std::filesystem::path folder_;
  const int32_t agent_id_;
  const int64_t max_bytes_;
  int lock_ = -1;
  std::map<int64_t, Segment> segments_;
  std::map<KeyframeId, Place> places_;
  int64_t bytes_ = 0;
  int64_t damaged_bytes_ = 0;
  int64_t num_damaged_ = 0;
  int64_t newest_ = 0;  // segment
  int fd_ = -1;         // of the newest, while it is written to
  int64_t next_event_ = 0;
  bool unsynced_ = false;
  bool refuses_ = false;
};

}  // namespace pangea
