#pragma once

// Keeps keyframes that are not acknowledged yet on disk. So hours without a server need disk space
// and not memory, and an uplink that is killed loses no keyframe.
//
// The spool is a folder of segments: ordinary LCM logs of KEYFRAME_k (keyframes_000001.lcm, ...). A
// segment is only appended to, and removed when all its keyframes are acknowledged. Every run
// begins a new segment, so nothing is ever written after a tail torn by a crash; torn tails are
// ignored. The page cache survives the death of the process; Sync makes the files survive a power
// cut.
//
// Each keyframe is followed by a CHECKSUMS event (checksums.h), which is verified on reading.
// Damage costs only the damaged keyframes. A segment with damage is renamed instead of removed
// (keyframes_000001.lcm.damaged-<UTC time>), and stays until somebody removes it.
//
// Bound: `max_bytes` of segments, with damaged ones. When it is reached, or the disk refuses, Add
// returns false, and the keyframe has to stay in memory. The index needs about 100 bytes of memory
// per keyframe. Not thread safe.

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "core/bytes.h"
#include "core/ids.h"
#include "log_file/checked_scan.h"

namespace pangea {

class Spool {
 public:
  static constexpr int64_t kSegmentBytes = 16 << 20;
  // The segment that is being written is not removed before it has this size, even if all its
  // keyframes are acknowledged; else a connected agent would make one file per keyframe.
  static constexpr int64_t kMinSegmentBytes = 1 << 20;

  // Creates the folder, or finds the keyframes of an earlier run. Throws std::runtime_error if the
  // folder cannot be used, is used by another process, or has keyframes of another agent.
  Spool(std::filesystem::path folder, int32_t agent_id, int64_t max_bytes);
  ~Spool();
  Spool(const Spool&) = delete;
  Spool& operator=(const Spool&) = delete;

  // `data`: an encoded keyframe_t. False if it was not written. A repeat changes nothing.
  bool Add(const KeyframeId& id, Bytes data, int64_t utime);
  // The encoded keyframe. Empty if it is not there, or is damaged; a damaged one is also dropped.
  std::vector<uint8_t> Read(const KeyframeId& id);
  // All keyframes of the map up to `seq` are acknowledged.
  void Release(const MapId& map, int32_t seq);
  void Sync();

  std::vector<KeyframeId> Kept() const;
  int64_t bytes() const { return bytes_; }
  // Bytes of the renamed segments with damage.
  int64_t damaged_bytes() const { return damaged_bytes_; }
  // Number of damaged places and keyframes found since the start.
  int64_t num_damaged() const { return num_damaged_; }
  // Whether the last Add failed, because of the disk or the bound.
  bool refuses() const { return refuses_; }

 private:
  struct Segment {
    int64_t bytes = 0;
    int kept = 0;  // number of keyframes not acknowledged yet
    bool damaged = false;
  };
  struct Place {
    int64_t segment = 0;
    int64_t offset = 0;  // of the event in its segment
    int32_t size = 0;
    uint32_t crc32 = 0;
  };

  [[noreturn]] void Refuse(const std::string& reason) const;  // only for the constructor
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
  int64_t newest_ = 0;  // number of the newest segment
  int fd_ = -1;         // of the newest segment while it is being written
  int64_t next_event_ = 0;
  bool unsynced_ = false;
  bool refuses_ = false;
};

}  // namespace pangea
