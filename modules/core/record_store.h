#pragma once

// Storage for bytes that a core seldom needs: in a RecordStore while that has room, else in memory.
// The core decides what to store and when. The process around it provides the RecordStore
// (files/scratch_file.h), or none. Records come back unchanged, so no result depends on where they
// were. Not thread safe.

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
  // Stores the record and returns its offset. Nothing when there is no room or it cannot be
  // written.
  virtual std::optional<int64_t> Append(std::span<const uint8_t> record) = 0;
  // Fills `record` with the record at `offset`, a result of Append. False if it cannot be read.
  virtual bool Read(int64_t offset, std::span<uint8_t> record) = 0;
  // Why the last failed call failed; empty when no call failed.
  virtual std::string problem() const = 0;
};

// Counters that an owner of records reports in its status.
struct RecordCounters {
  int64_t in_memory = 0;   // records now in memory, because the RecordStore has no room
  int64_t dropped = 0;     // records dropped with all that belongs to them: memory was full too
  int64_t unreadable = 0;  // how often a record could not be read back from the RecordStore
};

// One record, in a store or in memory. Its owner bounds how many records are in memory.
class Record {
 public:
  // Appends the bytes to the store. Keeps them in memory if `store` is null or has no room.
  Record(std::vector<uint8_t> bytes, RecordStore* store);
  // A record that is already in the store, at this offset.
  Record(int64_t offset, uint32_t size) : offset_(offset), size_(size) {}

  int64_t offset() const { return offset_; }  // in the store
  uint32_t size() const { return size_; }

  bool in_memory() const { return offset_ == kInMemory; }
  // `store` must be the one of the constructor. Nothing when the record cannot be read.
  std::optional<std::vector<uint8_t>> Bytes(RecordStore* store) const;

 private:
  static constexpr int64_t kInMemory = -1;

  int64_t offset_ = kInMemory;
  uint32_t size_ = 0;
  std::unique_ptr<uint8_t[]> bytes_;  // in memory
};

}  // namespace pangea
