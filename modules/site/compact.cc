#include "site/compact.h"

#include <fmt/format.h>
#include <unistd.h>

#include <sys/stat.h>

#include <cerrno>
#include <cstring>
#include <iostream>
#include <stdexcept>

#include "agent_handler/journal/journal.h"
#include "files/disk_io.h"
#include "log_file/log_reader.h"
#include "site/journal_contents.h"
#include "site/journal_writer.h"
#include "site/thinned_journal.h"

namespace pangea::site {
namespace {

namespace fs = std::filesystem;

// Opens the journal exclusively; damaged parts are kept in a file beside it. The checkpoints are
// removed before the damage is, for they have what it destroyed.
Journal Lock(const fs::path& journal, const fs::path& checkpoints) {
  return Journal(
      journal.string(), [](const std::string&, Bytes, const JournalPlace&) { return true; },
      [&checkpoints] { fs::remove_all(checkpoints); });
}

// Returns the contents that it wrote.
JournalContents WriteWhatCounts(const fs::path& from, const JournalContents& contents,
                                ThinnedJournal* thinned, const fs::path& to,
                                const std::function<void(CompactStep)>& on_step) {
  JournalWriter writer(to);
  CountingEvents counting(contents);
  LogReadings readings;
  JournalContents written;
  const auto write = [&](const LogEvent& event) {
    on_step(CompactStep::kWrite);
    writer.Write(event.utime, event.channel, event.data);
    written.Take(event);
  };
  const auto copy = [&](const LogEvent& event) {
    if (!counting.Counts(event)) {
      return;
    }
    thinned == nullptr ? write(event) : thinned->Rewrite(event, write);
  };
  ReadLog(from, copy, &readings);
  if (thinned != nullptr) {
    thinned->Finish(write);
  }
  writer.Finish();
  return written;
}

// Copies owner and mode: the server's user must be able to write the journal, whoever compacts it.
// Changes the owner only if needed: systemd may filter that system call.
void TakeOwner(const fs::path& from, const fs::path& to) {
  struct stat wanted {
  }, made{};
  bool done = stat(from.c_str(), &wanted) == 0 && stat(to.c_str(), &made) == 0;
  if (done && (wanted.st_uid != made.st_uid || wanted.st_gid != made.st_gid)) {
    done = chown(to.c_str(), wanted.st_uid, wanted.st_gid) == 0;
  }
  if (!done || chmod(to.c_str(), wanted.st_mode & 07777) != 0) {
    throw std::runtime_error(fmt::format("{}: cannot be given the owner of {}: {}; run as that one",
                                         to.string(), from.string(), std::strerror(errno)));
  }
}

// Writes the new journal, and checks that it says what it should. On failure nothing remains of it.
void WriteAndCompare(const fs::path& journal, const JournalContents& contents,
                     ThinnedJournal* thinned, const fs::path& made,
                     const std::function<void(CompactStep)>& on_step, CompactSummary* summary) try {
  const JournalContents meant = WriteWhatCounts(journal, contents, thinned, made, on_step);
  summary->events_after = meant.events;
  TakeOwner(journal, made);
  on_step(CompactStep::kWritten);
  const JournalContents written = ReadContents(made);
  if (!written.reading.whole() || !written.SaysTheSame(thinned != nullptr ? meant : contents)) {
    throw std::runtime_error(
        fmt::format("{}: does not say what {} says, and is thrown away; is the disk all right?",
                    made.string(), journal.string()));
  }
  summary->bytes_after = static_cast<int64_t>(fs::file_size(made));
  SyncToDisk(made);
  on_step(CompactStep::kCompared);
} catch (...) {
  fs::remove(made);
  throw;
}

}  // namespace

CompactSummary Compact(const Site& site, const std::optional<ThinJournal>& thin,
                       const std::function<void(CompactStep)>& on_step) {
  const SiteLock lock(site);
  if (!fs::exists(site.journal())) {
    throw std::runtime_error(
        fmt::format("{}: there is no journal yet, nothing to compact", site.journal().string()));
  }
  const fs::path journal = fs::canonical(site.journal());  // it may be a link to another disk
  const fs::path made = journal.string() + ".compacting";
  const Journal old = Lock(site.journal(), site.checkpoints());
  if (const std::string said = old.mend().Said(site.journal()); !said.empty()) {
    std::cerr << said << "\n";
  }
  fs::remove(made);  // left over by a killed run
  CompactSummary summary;
  summary.damaged = old.mend().damaged_bytes > 0;
  summary.bytes_before = static_cast<int64_t>(fs::file_size(journal));
  on_step(CompactStep::kRead);
  const JournalContents contents = ReadContents(journal);
  summary.events_before = contents.events;
  std::optional<ThinnedJournal> thinned;
  if (thin) {
    thinned = Thin(journal, *thin);
    summary.keyframes_gone = thinned->keyframes_gone();
    summary.constraints_derived = thinned->constraints_derived();
  }
  WriteAndCompare(journal, contents, thinned ? &*thinned : nullptr, made, on_step, &summary);
  fs::remove_all(site.checkpoints());  // they belong to the old journal
  fs::rename(made, journal);
  on_step(CompactStep::kSwapped);
  SyncToDisk(journal.parent_path());
  on_step(CompactStep::kDone);
  return summary;
}

}  // namespace pangea::site
