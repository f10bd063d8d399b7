#pragma once

// The keyframes stored for recognition, by number. Ids and landmarks are in memory. Corners and
// rays, which are needed only when a place is checked, are records (core/record_store.h); those of
// the places checked last are cached. Not thread safe.

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

// The parts of a keyframe that recognition uses.
struct RecognisedKeyframe {
  explicit RecognisedKeyframe(const Keyframe& keyframe);

  KeyframeId id;
  DescriptorKind descriptor_kind = DescriptorKind::kOrb;
  std::vector<Corner> corners;
  std::vector<CornerRay> rays;     // zero direction and sigma if the pixel cannot be undistorted
  std::vector<int32_t> landmarks;  // ascending

 private:
  friend class StoredKeyframes;
  RecognisedKeyframe() = default;
};

// A compact list of ascending numbers, 0 or higher: the first one, and the differences as base-128
// varints.
class AscendingNumbers {
 public:
  AscendingNumbers() = default;
  explicit AscendingNumbers(const std::vector<int32_t>& numbers);

  bool HasOneOf(const std::vector<int32_t>& ascending) const;

  void Save(ByteWriter* writer) const;
  // False if the bytes are not those of AscendingNumbers.
  bool Restore(ByteReader* reader);

 private:
  // Whether the gaps lead from the first number to the last one.
  bool IsConsistent() const;

  int32_t first_ = 0;
  int32_t last_ = -1;  // last_ < first_: the list is empty
  std::vector<uint8_t> gaps_;
};

// The record of a keyframe that StoredKeyframes writes to the RecordStore.
std::vector<uint8_t> CornersRecord(const Keyframe& keyframe);

class StoredKeyframes {
 public:
  // If `records` is null, everything stays in memory.
  explicit StoredKeyframes(std::shared_ptr<RecordStore> records) : records_(std::move(records)) {}

  // False, and nothing is stored, if neither the RecordStore nor memory has room for the corners.
  bool Add(const RecognisedKeyframe& keyframe);
  int size() const { return static_cast<int>(keyframes_.size()); }
  // Saves the places of the records, not the records: these must be at the same places in the
  // RecordStore when it is restored. Restore returns false if the bytes are not those of a
  // StoredKeyframes.
  void Save(ByteWriter* writer) const;
  bool Restore(ByteReader* reader);

  const std::shared_ptr<RecordStore>& records() const { return records_; }
  const KeyframeId& id(int number) const { return keyframes_[number].id; }
  DescriptorKind descriptor_kind(int number) const { return keyframes_[number].descriptor_kind; }
  bool SharesLandmark(int number, const RecognisedKeyframe& other) const;
  // Null if the record cannot be read. `landmarks` of the result is empty.
  std::shared_ptr<const RecognisedKeyframe> Find(int number);

  const RecordCounters& counters() const { return counters_; }

 private:
  static constexpr size_t kMaxFound = 256;        // about 50 kB each
  static constexpr int64_t kMaxInMemory = 20000;  // about 45 kB each

  struct Stored {
    KeyframeId id;
    DescriptorKind descriptor_kind;
    AscendingNumbers landmarks;
    Record corners;
  };

  std::shared_ptr<RecordStore> records_;
  std::deque<Stored> keyframes_;
  RecentCache<int, RecognisedKeyframe> found_{kMaxFound};
  RecordCounters counters_;
};

}  // namespace pangea
