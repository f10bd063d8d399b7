#pragma once

// Bytes that a core needs seldom, set aside: where a RecordStore has room for them, in memory else.
// The core says what and when; the process around it gives the store (files/scratch_file.h), or
// none. What is set aside comes back as it was, so no result depends on where it lay. Not thread
// safe.

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace pangea {

class RecordStore {
 public:
  virtual ~RecordStore() = default;
  // Where the record is from now on; nothing when there is no room for it.
  virtual std::optional<int64_t> Append(std::span<const uint8_t> record) = 0;
  // Fills `record` with what was appended at `offset`; whether all of it could be read.
  virtual bool Read(int64_t offset, std::span<uint8_t> record) = 0;
  // Why the last of them failed; empty when none did.
  virtual std::string problem() const = 0;
};

// What an owner of records tells of them.
struct RecordCounters {
  int64_t in_memory = 0;   // now, for lack of room in the RecordStore
  int64_t dropped = 0;     // with all that belongs to them, for lack of room there as well
  int64_t unreadable = 0;  // times that the RecordStore did not give one back
};

// One of them. Bounds are its owner's: a record in memory takes its size.
class Record {
 public:
  // `store` may be null.
  Record(std::vector<uint8_t> bytes, RecordStore* store);
  // In a store that has it there.
  Record(int64_t offset, uint32_t size) : offset_(offset), size_(size) {}

  int64_t offset() const { return offset_; }  // in the store
  uint32_t size() const { return size_; }

  bool in_memory() const { return offset_ == kInMemory; }
  // From the same store; nothing when it cannot be read.
  std::optional<std::vector<uint8_t>> Bytes(RecordStore* store) const;

 private:
  static constexpr int64_t kInMemory = -1;

  int64_t offset_ = kInMemory;
  uint32_t size_ = 0;
  std::unique_ptr<uint8_t[]> bytes_;  // in memory
};

}  // namespace pangea
