#include "bus/retransmission/journal_reader.h"

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
  // No pipe makes it wait.
  const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (fd < 0) {
    throw std::runtime_error(std::strerror(errno));
  }
  return fd;
}

}  // namespace

JournalReader::JournalReader(const JournalFile& file)
    : fd_(Open(file.path)), state_(file.state), scan_(fd_, 0, state_.num_bytes) {
  try {
    Check();
  } catch (...) {
    close(fd_);
    throw;
  }
}

JournalReader::~JournalReader() { close(fd_); }

void JournalReader::Check() const {
  struct stat info {};
  if (fstat(fd_, &info) != 0 || !S_ISREG(info.st_mode)) {
    throw std::runtime_error("it is no file");
  }
  if (info.st_size < state_.num_bytes) {
    throw std::runtime_error("it is shorter than the journal");
  }
  if (state_.last_event_offset >= 0) {
    LogScan last(fd_, state_.last_event_offset, state_.num_bytes);
    const auto piece = last.Next();
    if (!piece || piece->kind != LogPiece::Kind::kEvent ||
        EventChecksum(piece->whole) != state_.last_event_crc32) {
      throw std::runtime_error("it is another journal");
    }
  }
}

bool JournalReader::Next(const Handler& handler) {
  for (const int64_t end = at_ + kPieceBytes; at_ < end;) {
    const auto piece = scan_.Next();
    if (!piece) {
      return false;
    }
    at_ = piece->end();
    if (piece->kind == LogPiece::Kind::kEvent) {
      handler(piece->channel, piece->data);
    }
  }
  return true;
}

void JournalReader::Rewind() {
  scan_ = LogScan(fd_, 0, state_.num_bytes);
  at_ = 0;
}

}  // namespace pangea
