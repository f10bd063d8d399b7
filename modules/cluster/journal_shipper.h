#pragma once

// Stores a core's journal in the site's stream, event by event in the file's order. An event is
// stored only if the stream's newest event is the one stored before it. A core begins by storing
// its term in the stream (site_lease.h); from then on, a former core cannot store anything, even if
// it believes to have the lease. So the stream has one writer at a time, and is the site's true
// journal. The file is a copy of it, which may be ahead by events that were not acknowledged.
//
// The core stores its term again after every kEventsPerMark events, as a mark: each host remembers
// the newest one (JournalCursor), and its next start compares only what comes behind it.
//
// Events that belong to the file itself (CHECKSUMS, DAMAGED) are not stored. Not thread safe.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>

#include "cluster/site_streams.h"
#include "log_file/log_scan.h"
#include "messages/catch_up_messages.h"

namespace pangea {

// A position up to which a file and the stream have the same events.
struct JournalCursor {
  JournalState file;
  uint64_t sequence = 0;  // the position in the stream
  uint64_t term = 0;      // the term stored at this sequence; 0: it is an event

  // The cursor in the file "<journal>.stream", for the next start. If it is missing, or is of
  // another journal or stream, Read returns the beginning.
  static JournalCursor Read(const std::filesystem::path& journal, SiteStreams& streams);
  void Write(const std::filesystem::path& journal) const;
};

// Another core has begun.
struct LeaseLost : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// Stores the term at the end of the stream and returns its sequence. Throws std::runtime_error when
// NATS does not take it.
uint64_t StoreTerm(SiteStreams& streams, uint64_t term);

// Whether the piece belongs to the file itself and is not an event of the journal.
bool IsOfFile(const LogPiece& piece);

class JournalShipper {
 public:
  static constexpr uint64_t kEventsPerMark = 1000;

  // `term` is stored in the stream, with the sequence `begin`.
  JournalShipper(SiteStreams& streams, uint64_t term, uint64_t begin)
      : streams_(streams), term_(term), begin_(begin) {}

  // Which file the journal is, and how much of it is on the disk.
  void OnJournalFile(const JournalFile& file);
  // Stores the next events. Throws LeaseLost, or std::runtime_error when the stream has other
  // events.
  void Ship();

  // How much of the file is in the stream. Nothing while it is not known whether the file has all
  // events that were in the stream before the term.
  std::optional<JournalFile> shipped() const {
    return sequence_ >= begin_ && !shipped_.path.empty() ? std::optional(shipped_) : std::nullopt;
  }
  int64_t bytes_to_ship() const { return wanted_bytes_ - shipped_.state.num_bytes; }
  int64_t num_too_large() const { return num_too_large_; }

 private:
  static constexpr int64_t kPieceBytes = 1'000'000;

  void ShipEvents();
  void PassTerms();
  // Returns whether the event is in the stream now.
  bool ShipEvent(const LogPiece& event);
  // Finds the stream's next event and skips terms; no event: the end of the stream. False if NATS
  // does not answer.
  bool FindNext(std::optional<SiteStreams::JournalEvent>* event);
  // Stores a mark if it is time, and remembers the newest one.
  void Mark();

  SiteStreams& streams_;
  const uint64_t term_;
  const uint64_t begin_;
  JournalFile shipped_;
  int64_t wanted_bytes_ = 0;
  uint64_t sequence_ = 0;  // of the newest message that the file has too
  uint64_t end_ = 0;       // newest known sequence of the stream
  JournalCursor mark_;     // at the newest term that the file has passed
  uint64_t tried_ = 0;     // sequence of the mark that was last written, or could not be
  int64_t num_too_large_ = 0;
};

}  // namespace pangea
