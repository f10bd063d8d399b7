#include "cluster/journal_copy.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "log_file/checksums.h"
#include "log_file/damaged_copy.h"

namespace pangea {

JournalCopy::JournalCopy(std::filesystem::path journal, SiteStreams& streams)
    : path_(std::move(journal)), streams_(streams) {
  fd_ = open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  struct stat info {};
  if (fd_ < 0 || fstat(fd_, &info) != 0) {
    throw std::runtime_error(fmt::format("{}: {}", path_.string(), std::strerror(errno)));
  }
  at_ = JournalCursor::Read(path_, streams_);
  scan_.emplace(fd_, at_.file.num_bytes, info.st_size);
}

JournalCopy::~JournalCopy() { close(fd_); }

std::optional<bool> JournalCopy::HasNext(const SiteStreams::JournalEvent& event) {
  while (const auto piece = scan_->Next()) {
    if (piece->kind != LogPiece::Kind::kEvent) {
      return false;
    }
    const bool of_file = IsOfFile(*piece);
    if (!of_file &&
        (piece->channel != event.channel || !std::ranges::equal(piece->data, event.data))) {
      return false;
    }
    at_.file = {piece->end(), piece->offset, EventChecksum(piece->whole)};
    if (!of_file) {
      return true;
    }
  }
  return std::nullopt;
}

void JournalCopy::Cut() {
  const int64_t begin = at_.file.num_bytes;
  if (begin == 0) {
    throw std::runtime_error(fmt::format(
        "{}: begins otherwise than the site's journal in NATS. If it is another site's, give this "
        "site another name; if it was compacted, move it away: NATS has all of it",
        path_.string()));
  }
  cut_ = KeepDamaged(path_.string(), fd_, {{begin, scan_->file_bytes()}});
  if (ftruncate(fd_, begin) != 0) {
    throw std::runtime_error(fmt::format("{}: {}", path_.string(), std::strerror(errno)));
  }
}

void JournalCopy::Append(const SiteStreams::JournalEvent& event) {
  if (!journal_) {
    scan_.reset();
    journal_ = std::make_unique<Journal>(
        path_.string(), [](const std::string&, Bytes, const JournalPlace&) { return true; });
  }
  journal_->Append(event.utime, event.channel, event.data);
}

bool JournalCopy::Follow() {
  const uint64_t end = streams_.JournalEnd().value_or(0);
  bool at_mark = false;
  for (int taken = 0; taken < kPiece && at_.sequence < end && !at_mark; ++taken) {
    const auto event = streams_.EventAt(at_.sequence + 1);
    if (!event) {
      break;
    }
    if (event->term == 0) {
      const auto has = scan_ ? HasNext(*event) : std::nullopt;
      if (has == false) {
        Cut();
      }
      if (has != true) {
        Append(*event);
      }
    }
    ++at_.sequence;
    at_.term = event->term;
    at_mark = event->term > 0 && cursor().file.num_bytes > 0;
  }
  if (journal_ && !journal_->Sync()) {
    throw std::runtime_error(fmt::format("{}: the disk refuses writes", path_.string()));
  }
  if (at_mark) {
    cursor().Write(path_);
  }
  return at_.sequence < end;
}

JournalCursor JournalCopy::cursor() const {
  return journal_ ? JournalCursor{journal_->state(), at_.sequence, at_.term} : at_;
}

}  // namespace pangea
