#include "journal_follower/journal_records.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "files/disk_io.h"
#include "log_file/log_event.h"
#include "messages/encoding.h"
#include "messages/messages.h"

namespace pangea {
namespace {

// The data of the event at `offset`; empty if there is no event.
std::vector<uint8_t> ReadEventData(int fd, int64_t offset) {
  std::vector<uint8_t> bytes(LogEventHeader::kBytes);
  if (!ReadFully(fd, offset, bytes.data(), bytes.size())) {
    return {};
  }
  const auto header = ParseLogEventHeader(bytes);
  if (!header) {
    return {};
  }
  bytes.resize(static_cast<size_t>(header->data_bytes));
  const int64_t data_offset = offset + header->event_bytes() - header->data_bytes;
  return ReadFully(fd, data_offset, bytes.data(), bytes.size()) ? bytes : std::vector<uint8_t>{};
}

}  // namespace

JournalRecords::~JournalRecords() {
  if (fd_ >= 0) {
    close(fd_);
  }
}

void JournalRecords::Open(const std::string& path) {
  fd_ = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (fd_ < 0) {
    throw std::runtime_error(std::strerror(errno));
  }
}

std::optional<int64_t> JournalRecords::Append(std::span<const uint8_t> record) {
  if (event_) {
    return kJournal + *event_;
  }
  return others_ == nullptr ? std::nullopt : others_->Append(record);
}

bool JournalRecords::Read(int64_t offset, std::span<uint8_t> record) {
  if (offset < kJournal) {
    return others_ != nullptr && others_->Read(offset, record);
  }
  const std::vector<uint8_t> data = ReadEventData(fd_, offset - kJournal);
  if (const auto keyframe = ParseMessage<KeyframeMessage>(data); keyframe.value) {
    const std::vector<uint8_t> made = encoder_(*keyframe.value);
    if (made.size() == record.size()) {
      std::copy(made.begin(), made.end(), record.begin());
      return true;
    }
  }
  problem_ = "a keyframe cannot be read from the journal any more";
  return false;
}

std::string JournalRecords::problem() const {
  return problem_.empty() && others_ != nullptr ? others_->problem() : problem_;
}

}  // namespace pangea
