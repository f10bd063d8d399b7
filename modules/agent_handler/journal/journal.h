#pragma once

// The journal: an append-only LCM log on disk, which every LCM tool can read.
//
// Append only queues an event; Sync writes the queue and waits for the disk (fdatasync). Events
// that were not synced may be lost, and are never acknowledged. If the disk fails (full),
// everything stays queued and Sync is tried again. Full() tells the caller to stop appending, which
// bounds the queue. Not thread safe.
//
// After each synced group there is a CHECKSUMS event (checksums.h) for the group and the kRepeated
// events before it, so that one CHECKSUMS event may be lost. All events are numbered together.
//
// When a journal is opened, it is brought to the disk and read to its end, past any damage: bytes
// that are no event, events with a wrong checksum, and events whose content is damaged. The damaged
// parts, and a tail torn by a crash, are first copied to a file beside the journal
// (damaged_copy.h). Then the tail is cut off, and damaged parts become DAMAGED events of the same
// size. So every LCM tool can read the journal to its end, and all other events stay in place. A
// file that is not a log is refused and not changed.

#include <cstdint>
#include <deque>
#include <functional>
#include <string>
#include <vector>

#include "agent_handler/journal/journal_index.h"
#include "agent_handler/journal/journal_mend.h"
#include "core/bytes.h"
#include "log_file/checked_scan.h"

namespace pangea {

class Journal {
 public:
  static constexpr size_t kMaxQueuedBytes = 1 << 20;
  static constexpr size_t kRepeated = 16;

  // Called for each event of an existing journal. Returns false if its content is damaged.
  using Visitor =
      std::function<bool(const std::string& channel, Bytes data, const JournalPlace& place)>;

  // Opens or creates the journal. Throws std::runtime_error if it cannot be opened, is in use by
  // another process, is not a log, or its damaged parts cannot be copied. `before_mend` is called
  // before damage is repaired, which the next opening does not see any more.
  Journal(const std::string& path, const Visitor& visitor,
          const std::function<void()>& before_mend = nullptr);
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  bool Full() const { return queue_.size() >= kMaxQueuedBytes; }
  bool HasUnsynced() const { return !queue_.empty(); }
  JournalPlace Append(int64_t utime, const std::string& channel, Bytes data);
  // False if the disk failed; the queue is then kept.
  bool Sync();
  // The data of the event. Empty if it cannot be read or its checksum is wrong.
  std::vector<uint8_t> Read(const JournalPlace& place) const;

  int64_t size() const { return synced_bytes_; }
  // For other processes that read the file.
  const std::string& path() const { return path_; }
  JournalState state() const {
    return {synced_bytes_, last_event_.size > 0 ? last_event_.offset : -1, last_event_.crc32};
  }
  // The repairs made when the journal was opened.
  const JournalMend& mend() const { return mend_; }

 private:
  void Load(const Visitor& visitor, const std::function<void()>& before_mend);
  std::vector<DamagedPart> Scan(const Visitor& visitor);
  bool Take(const CheckedScan::Piece& piece, const Visitor& visitor);
  void Note(int64_t number, int64_t utime, uint32_t crc32);
  void KeepNewest(size_t count);

  const std::string path_;
  int fd_ = -1;
  int64_t synced_bytes_ = 0;  // length of the file
  JournalMend mend_;
  int64_t next_event_ = 0;
  int64_t last_utime_ = 0;
  JournalPlace last_event_;            // the last event on the disk; size 0: none
  std::deque<uint32_t> newest_crc32_;  // checksums of the last events before next_event_
  std::vector<uint8_t> queue_;
};

}  // namespace pangea
