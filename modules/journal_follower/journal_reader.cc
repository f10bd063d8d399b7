#include "journal_follower/journal_reader.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <vector>

#include "log_file/checksums.h"
#include "log_file/log_event.h"

namespace pangea {
namespace {

int Open(const std::string& path) {
  // With O_NONBLOCK, opening a named pipe does not wait.
  const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (fd < 0) {
    throw std::runtime_error(std::strerror(errno));
  }
  return fd;
}

// Checksum of the event at `offset`, which ends at `end` or before; nothing if there is no event.
std::optional<uint32_t> ChecksumAt(int fd, int64_t offset, int64_t end) {
  LogScan scan(fd, offset, end);
  const auto piece = scan.Next();
  return piece && piece->kind == LogPiece::Kind::kEvent ? std::optional(EventChecksum(piece->whole))
                                                        : std::nullopt;
}

bool EndsWith(int fd, const JournalState& state) {
  return ChecksumAt(fd, state.last_event_offset, state.num_bytes) == state.last_event_crc32;
}

}  // namespace

JournalReader::JournalReader(const JournalFile& file)
    : fd_(Open(file.path)), state_(file.state), scan_(fd_, 0, state_.num_bytes) {
  try {
    struct stat info {};
    if (fstat(fd_, &info) != 0 || !S_ISREG(info.st_mode)) {
      throw std::runtime_error("it is no file");
    }
    if (info.st_size < state_.num_bytes) {
      throw std::runtime_error("it is shorter than the journal");
    }
    Check(state_);
  } catch (...) {
    close(fd_);
    throw;
  }
}

JournalReader::~JournalReader() { close(fd_); }

void JournalReader::Check(const JournalState& state) const {
  if (state.last_event_offset >= 0 && !EndsWith(fd_, state)) {
    throw std::runtime_error("it is another journal");
  }
}

void JournalReader::StartBehind(const JournalState& state) {
  if (state.num_bytes > state_.num_bytes) {
    throw std::runtime_error("the journal is shorter");
  }
  Check(state);
  begin_ = state;
  Rewind();
}

std::optional<LogPiece> JournalReader::NextPiece() {
  try {
    return scan_.Next();
  } catch (const std::runtime_error& error) {
    throw JournalUnreadable(error.what());
  }
}

bool JournalReader::Next(const Handler& handler) {
  for (const int64_t end = at_ + kPieceBytes; at_ < end;) {
    const auto piece = NextPiece();
    if (!piece) {
      return false;
    }
    if (piece->kind == LogPiece::Kind::kEvent) {
      if (!handler(piece->channel, piece->data, piece->offset)) {
        return false;
      }
      last_event_offset_ = piece->offset;
    }
    at_ = piece->end();
  }
  return true;
}

void JournalReader::Rewind() {
  scan_ = LogScan(fd_, begin_.num_bytes, state_.num_bytes);
  at_ = begin_.num_bytes;
  last_event_offset_ = begin_.last_event_offset;
}

JournalState JournalReader::position() const {
  JournalState state{at_, last_event_offset_, 0};
  if (last_event_offset_ >= 0) {
    state.last_event_crc32 = ChecksumAt(fd_, last_event_offset_, at_).value_or(0);
  }
  return state;
}

JournalState ReadJournalState(const std::string& path, const JournalState& known) {
  const int fd = Open(path);
  JournalState state;
  try {
    struct stat info {};
    const bool is_known = fstat(fd, &info) == 0 && known.last_event_offset >= 0 &&
                          known.num_bytes <= info.st_size && EndsWith(fd, known);
    state = is_known ? known : JournalState{};
    LogScan scan(fd, state.num_bytes, info.st_size);
    while (const auto piece = scan.Next()) {
      if (piece->kind == LogPiece::Kind::kEvent) {
        state = {piece->end(), piece->offset, 0};
      }
    }
    if (state.last_event_offset >= 0) {
      state.last_event_crc32 = ChecksumAt(fd, state.last_event_offset, state.num_bytes).value_or(0);
    }
  } catch (...) {
    close(fd);
    throw;
  }
  close(fd);
  return state;
}

}  // namespace pangea
