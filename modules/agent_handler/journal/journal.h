#pragma once

// The journal: an append-only LCM log on disk, so that every LCM tool reads it.
//
// Append queues; Sync writes the queue and waits for the disk (fdatasync). What has not been synced
// may be lost, and is never acknowledged. If the disk refuses (full), everything stays queued and
// Sync is tried again; the queue is bounded by Full(), which tells the caller to stop appending.
//
// Behind each group that is synced stands a CHECKSUMS event (checksums.h) of it and of the
// kRepeated events before it, so that one such list may be lost; all events are numbered together.
//
// A journal that is opened is read to its end, past damage: what is no event, an event with another
// checksum than it was written with, one whose content is damaged. All that, and a tail torn by a
// crash, is first kept in a file beside it (damaged_copy.h). Then the tail is cut, and damage is
// made DAMAGED events of the same size, so that the journal stays a log that every LCM tool reads
// to its end, with everything else in its place. A file that is no log is refused and stays as it
// is.

#include <cstdint>
#include <deque>
#include <functional>
#include <string>
#include <vector>

#include "agent_handler/journal/journal_index.h"
#include "agent_handler/journal/journal_mend.h"
#include "bus/bus.h"
#include "log_file/checked_scan.h"

namespace pangea {

class Journal {
 public:
  static constexpr size_t kMaxQueuedBytes = 1 << 20;
  static constexpr size_t kRepeated = 16;

  // Each event of an existing journal; false if its content is damaged.
  using Visitor =
      std::function<bool(const std::string& channel, Bytes data, const JournalPlace& place)>;

  // Opens or creates. Throws std::runtime_error: cannot be opened, in use by another process, no
  // log, damaged and its damaged parts cannot be kept.
  Journal(const std::string& path, const Visitor& visitor);
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  bool Full() const { return queue_.size() >= kMaxQueuedBytes; }
  bool HasUnsynced() const { return !queue_.empty(); }
  JournalPlace Append(int64_t utime, const std::string& channel, Bytes data);
  // False if the disk refused.
  bool Sync();
  // The event's data. Empty if it cannot be read, or has become another.
  std::vector<uint8_t> Read(const JournalPlace& place) const;

  int64_t size() const { return synced_bytes_; }
  // For who reads the file beside us.
  const std::string& path() const { return path_; }
  JournalState state() const {
    return {synced_bytes_, last_event_.size > 0 ? last_event_.offset : -1, last_event_.crc32};
  }
  // What was found when it was opened.
  const JournalMend& mend() const { return mend_; }

 private:
  void Load(const Visitor& visitor);
  std::vector<DamagedPart> Scan(const Visitor& visitor);
  bool Take(const CheckedScan::Piece& piece, const Visitor& visitor);
  void Note(int64_t number, int64_t utime, uint32_t crc32);
  void KeepNewest(size_t count);

  const std::string path_;
  int fd_ = -1;
  int64_t synced_bytes_ = 0;  // the file's length
  JournalMend mend_;
  int64_t next_event_ = 0;
  int64_t last_utime_ = 0;
  JournalPlace last_event_;            // on the disk; of no size: none
  std::deque<uint32_t> newest_crc32_;  // of the events up to next_event_, without a gap
  std::vector<uint8_t> queue_;
};

}  // namespace pangea
