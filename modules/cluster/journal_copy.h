#pragma once

// A standby's journal: a file that follows the site's stream. What it has already is compared with
// the stream, event by event; where it has another event (this host was the core, and wrote what it
// told nobody was kept), its end is cut off, kept beside it (log_file/damaged_copy.h), and the
// stream's events take its place. A file that goes on where the stream ends stays as it is. One
// that differs from its first event on is another site's and is refused. One thread.

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
  // Throws std::runtime_error, as all the others, when the file cannot be read or written.
  JournalCopy(std::filesystem::path journal, SiteStreams& streams);
  ~JournalCopy();
  JournalCopy(const JournalCopy&) = delete;
  JournalCopy& operator=(const JournalCopy&) = delete;

  // Some of what is new in the stream; on the disk when this returns. Whether there may be more.
  bool Follow();
  // Up to where the file is the stream's.
  JournalCursor cursor() const;
  // For people; what was cut off, if anything was.
  const std::string& cut() const { return cut_; }

 private:
  static constexpr int kPiece = 500;

  // The file's next event is this one. False: it has another. Nothing: it has none.
  std::optional<bool> HasNext(const SiteStreams::JournalEvent& event);
  void Cut();
  void Append(const SiteStreams::JournalEvent& event);

  const std::filesystem::path path_;
  SiteStreams& streams_;
  int fd_ = -1;
  std::optional<LogScan> scan_;       // of what is still to be compared
  JournalCursor at_;                  // so much was
  std::unique_ptr<Journal> journal_;  // once it is written to
  std::string cut_;
};

}  // namespace pangea
