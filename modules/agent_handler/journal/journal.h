#pragma once

// The journal: an append-only LCM log on disk, so that every LCM tool reads it.
//
// Append queues; Sync writes the queue and waits for the disk (fdatasync). What has not been synced
// may be lost, and is never acknowledged. If the disk refuses (full), everything stays queued and
// Sync is tried again; the queue is bounded by Full(), which tells the caller to stop appending.
//
// A tail torn by a crash is cut when the journal is opened. More than kMaxTornBytes that cannot be
// read is not a torn tail but damage: that is refused, so that nothing is thrown away silently.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "agent_handler/journal/journal_index.h"
#include "bus/bus.h"

namespace pangea {

class Journal {
 public:
  static constexpr size_t kMaxQueuedBytes = 1 << 20;
  static constexpr int64_t kMaxTornBytes = 2 << 20;

  // Each event of an existing journal; false if its content is damaged.
  using Visitor =
      std::function<bool(const std::string& channel, Bytes data, const JournalPlace& place)>;

  // Opens or creates. Throws std::runtime_error: cannot be opened, in use by another process,
  // damaged.
  Journal(const std::string& path, const Visitor& visitor);
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  bool Full() const { return queue_.size() >= kMaxQueuedBytes; }
  bool HasUnsynced() const { return !queue_.empty(); }
  JournalPlace Append(int64_t utime, const std::string& channel, Bytes data);
  // False if the disk refused.
  bool Sync();
  // Empty if it cannot be read.
  std::vector<uint8_t> Read(const JournalPlace& place) const;

  int64_t size() const { return synced_bytes_; }
  int64_t cut_bytes() const { return cut_bytes_; }

 private:
  void Load(const Visitor& visitor);

  const std::string path_;
  int fd_ = -1;
  int64_t synced_bytes_ = 0;  // the file's good length
  int64_t cut_bytes_ = 0;
  int64_t next_event_ = 0;
  std::vector<uint8_t> queue_;
};

}  // namespace pangea
