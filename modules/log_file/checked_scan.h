#pragma once

// A LogScan that verifies the checksums in the log: an event whose checksum differs from the one in
// the log is returned as damage.
//
// Events wait for the CHECKSUMS event that follows them. In a log without CHECKSUMS (of an older
// version, or a capture), events are returned unchecked once kMaxWaitingBytes are waiting. The
// order of the events stays the same. Not thread safe.

#include <deque>

#include "log_file/checksums.h"
#include "log_file/log_scan.h"

namespace pangea {

// Whether an event only fills the place of damage. Its channel is DAMAGED, or as many of the first
// letters of this name as there was room for.
bool FillsDamage(const LogPiece& event);

class CheckedScan {
 public:
  static constexpr size_t kMaxWaitingBytes = 4 << 20;

  struct Piece : LogPiece {
    // Checksum of the event's bytes in the file. Computed only on demand, because most logs have no
    // checksums to compare it with.
    uint32_t crc32() const;

   private:
    mutable std::optional<uint32_t> crc32_;
  };

  explicit CheckedScan(int fd) : scan_(fd) {}

  // As LogScan::Next: the next piece, null at the end. Valid until the next call.
  const Piece* Next();
  int64_t file_bytes() const { return scan_.file_bytes(); }

 private:
  struct Waiting {
    Piece piece;
    std::vector<uint8_t> bytes;  // the bytes that `piece` points to
  };
  bool Read();
  void Verify(const Checksums& checksums);
  // Marks events that the checksums contradict as damage. Returns whether it marked any.
  bool FindDamage(const Checksums& checksums);

  LogScan scan_;
  std::deque<Waiting> waiting_;
  size_t waiting_bytes_ = 0;
  size_t num_ready_ = 0;  // how many of the first waiting pieces can be returned
  Waiting current_;
};

}  // namespace pangea
