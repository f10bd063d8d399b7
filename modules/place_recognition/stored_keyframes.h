#pragma once

// The keyframes that recognition remembers, by number. In memory are ids, landmarks and where the
// rest is; corners and rays, which only the verification of a place needs, are records
// (core/record_store.h), and in memory for those verified last. Not thread safe.

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <vector>

#include "core/byte_record.h"
#include "core/keyframe.h"
#include "core/recent_cache.h"
#include "core/record_store.h"
#include "place_recognition/epipolar_check.h"

namespace pangea {

// A keyframe as recognition looks at it.
struct RecognisedKeyframe {
  explicit RecognisedKeyframe(const Keyframe& keyframe);

  KeyframeId id;
  std::vector<Corner> corners;
  std::vector<CornerRay> rays;     // zero direction where a pixel cannot be undistorted
  std::vector<int32_t> landmarks;  // ascending

 private:
  friend class StoredKeyframes;
  RecognisedKeyframe() = default;
};

// Ascending numbers, most of them in one byte: the first one, and the gaps as base-128 varints.
class AscendingNumbers {
 public:
  AscendingNumbers() = default;
  explicit AscendingNumbers(const std::vector<int32_t>& numbers);

  bool HasOneOf(const std::vector<int32_t>& ascending) const;

  void Save(ByteWriter* writer) const;
  void Restore(ByteReader* reader);

 private:
  int32_t first_ = 0;
  int32_t last_ = -1;  // before the first one: there are none
  std::vector<uint8_t> gaps_;
};

// What StoredKeyframes keeps of a keyframe in the RecordStore.
std::vector<uint8_t> CornersRecord(const Keyframe& keyframe);

class StoredKeyframes {
 public:
  // Without a RecordStore everything stays in memory.
  explicit StoredKeyframes(std::shared_ptr<RecordStore> records) : records_(std::move(records)) {}

  // False when there is no room for its corners, neither in the RecordStore nor in memory: then
  // nothing of it is kept.
  bool Add(const RecognisedKeyframe& keyframe);
  int size() const { return static_cast<int>(keyframes_.size()); }
  // Where the records are, not these themselves: whoever restores it has them at the same places.
  // False if these are not its bytes.
  void Save(ByteWriter* writer) const;
  bool Restore(ByteReader* reader);

  const std::shared_ptr<RecordStore>& records() const { return records_; }
  const KeyframeId& id(int number) const { return keyframes_[number].id; }
  bool SharesLandmark(int number, const RecognisedKeyframe& other) const;
  // Null when it cannot be read. Its landmarks are empty.
  std::shared_ptr<const RecognisedKeyframe> Find(int number);

  const RecordCounters& counters() const { return counters_; }

 private:
  static constexpr size_t kMaxFound = 256;        // about 50 kB each
  static constexpr int64_t kMaxInMemory = 20000;  // about 45 kB each

  struct Stored {
    KeyframeId id;
    AscendingNumbers landmarks;
    Record corners;
  };

  std::shared_ptr<RecordStore> records_;
  std::deque<Stored> keyframes_;
  RecentCache<int, RecognisedKeyframe> found_{kMaxFound};
  RecordCounters counters_;
};

}  // namespace pangea
