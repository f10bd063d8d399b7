#pragma once

// A standby's journal: a file that follows the site's stream. Events that it already has are
// compared with the stream, one by one. If one differs (this host was the core, and wrote events
// that were never acknowledged), the file from there on is copied to a file beside it
// (log_file/damaged_copy.h) and replaced by the stream's events. A file that continues after the
// end of the stream stays as it is. A file whose first event differs is another site's, and is
// refused. Not thread safe.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "agent_handler/journal/journal.h"
#include "cluster/journal_shipper.h"
#include "cluster/site_streams.h"

namespace pangea {

class JournalCopy {
 public:
  // This and all other functions throw std::runtime_error when the file cannot be read or written.
  JournalCopy(std::filesystem::path journal, SiteStreams& streams);
  ~JournalCopy();
  JournalCopy(const JournalCopy&) = delete;
  JournalCopy& operator=(const JournalCopy&) = delete;

  // Copies some new events of the stream; they are on the disk when this returns, and a mark that
  // was passed is remembered (journal_shipper.h). Returns whether there may be more.
  bool Follow();
  // Up to where the file and the stream are equal.
  JournalCursor cursor() const;
  // For people: the file with the events that were cut off; empty if none were.
  const std::string& cut() const { return cut_; }

 private:
  static constexpr int kPiece = 500;

  // Whether the file's next event is this one. Nothing if the file has no next event.
  std::optional<bool> HasNext(const SiteStreams::JournalEvent& event);
  void Cut();
  void Append(const SiteStreams::JournalEvent& event);

  const std::filesystem::path path_;
  SiteStreams& streams_;
  int fd_ = -1;
  std::optional<LogScan> scan_;       // the part of the file that is still to be compared
  JournalCursor at_;                  // the part that was compared
  std::unique_ptr<Journal> journal_;  // set when the first event is appended
  std::string cut_;
};

}  // namespace pangea
