#pragma once

// LogScan with the checksums in the log: an event whose own is another than it was written with
// comes out as damage.
//
// Events wait for the CHECKSUMS event behind them; those of a log that has none (an older
// version's, a capture) come out unchecked once kMaxWaitingBytes wait. In what order events come
// does not change. One thread.

#include <deque>

#include "log_file/checksums.h"
#include "log_file/log_scan.h"

namespace pangea {

// Whether an event only fills the place of damage: on DAMAGED, or so many of its letters as there
// was room for.
bool FillsDamage(const LogPiece& event);

class CheckedScan {
 public:
  static constexpr size_t kMaxWaitingBytes = 4 << 20;

  struct Piece : LogPiece {
    // Of an event, as it is in the file. Computed when asked for: most logs have nothing to compare
    // it with.
    uint32_t crc32() const;

   private:
    mutable std::optional<uint32_t> crc32_;
  };

  explicit CheckedScan(int fd) : scan_(fd) {}

  // As LogScan's.
  const Piece* Next();
  int64_t file_bytes() const { return scan_.file_bytes(); }

 private:
  struct Waiting {
    Piece piece;
    std::vector<uint8_t> bytes;  // what `piece` looks into
  };
  bool Read();
  void Verify(const Checksums& checksums);
  // Whether there was any that was not known yet.
  bool FindDamage(const Checksums& checksums);

  LogScan scan_;
  std::deque<Waiting> waiting_;
  size_t waiting_bytes_ = 0;
  size_t num_ready_ = 0;  // of the first that wait
  Waiting current_;
};

}  // namespace pangea
