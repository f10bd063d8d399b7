#pragma once

// A core's journal into the site's stream, event by event in the file's order, each stored only if
// the stream's newest is the one stored before it. A core begins by storing its term there
// (site_lease.h): from then on whoever had the lease before can store nothing, whatever it
// believes. So the stream has one writer at a time, and is what the site has: the file is a copy of
// it, and may be ahead of it by what nobody was told is kept.
//
// Events of the file's own (CHECKSUMS, DAMAGED) do not go. One thread.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>

#include "cluster/site_streams.h"
#include "log_file/log_scan.h"
#include "messages/catch_up_messages.h"

namespace pangea {

// Up to where a file's events are the stream's.
struct JournalCursor {
  JournalState file;
  uint64_t sequence = 0;  // in the stream
  uint64_t term = 0;      // that is there; 0: an event is

  // "<journal>.stream", which says it for the next start. One that is not there, of another journal
  // or of another stream is the beginning.
  static JournalCursor Read(const std::filesystem::path& journal, SiteStreams& streams);
  void Write(const std::filesystem::path& journal) const;
};

// Another core has begun.
struct LeaseLost : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// Stores it behind all that is in the stream; its sequence there. Throws std::runtime_error when
// NATS does not answer.
uint64_t StoreTerm(SiteStreams& streams, uint64_t term);

// Whether it is of the file and not of the journal.
bool IsOfFile(const LogPiece& piece);

class JournalShipper {
 public:
  // `term` is in the stream, at `begin`.
  JournalShipper(SiteStreams& streams, uint64_t term, uint64_t begin)
      : streams_(streams), term_(term), begin_(begin) {}

  // So much is on the disk; the first call says which file.
  void OnJournalFile(const JournalFile& file);
  // The next events. Throws LeaseLost, and std::runtime_error when the stream has others.
  void Ship();

  // So much of the file is in the stream; nothing: it is not known whether the file has all that
  // was there before the term.
  std::optional<JournalFile> shipped() const {
    return sequence_ >= begin_ && !shipped_.path.empty() ? std::optional(shipped_) : std::nullopt;
  }
  int64_t bytes_to_ship() const { return wanted_bytes_ - shipped_.state.num_bytes; }
  int64_t num_too_large() const { return num_too_large_; }

 private:
  static constexpr int64_t kPieceBytes = 1'000'000;

  void PassTerms();
  // Whether it is in the stream now.
  bool ShipEvent(const LogPiece& event);
  // The stream's next event, past terms; false: it is not known.
  bool FindNext(std::optional<SiteStreams::JournalEvent>* event);

  SiteStreams& streams_;
  const uint64_t term_;
  const uint64_t begin_;
  JournalFile shipped_;
  int64_t wanted_bytes_ = 0;
  uint64_t sequence_ = 0;  // of the newest that the file has too
  uint64_t end_ = 0;       // of the stream, as far as is known
  int64_t num_too_large_ = 0;
};

}  // namespace pangea
