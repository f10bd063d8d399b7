#include "log_file/log_reader.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <stdexcept>

#include "files/progress.h"
#include "log_file/log_event.h"
#include "messages/channels.h"

namespace pangea {
namespace {

int Open(const std::string& path) {
  if (!std::filesystem::exists(path)) {
    throw std::runtime_error(fmt::format("{}: there is no such log", path));
  }
  if (!std::filesystem::is_regular_file(path)) {
    throw std::runtime_error(fmt::format("{}: is no file, but a folder or device", path));
  }
  const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) {
    throw std::runtime_error(fmt::format("{}: cannot be opened: {}", path, std::strerror(errno)));
  }
  return fd;
}

}  // namespace

LogReader::LogReader(const std::string& path) : path_(path), fd_(Open(path)), scan_(fd_) {}

LogReader::~LogReader() { close(fd_); }

const LogPiece* LogReader::NextPiece() {
  try {
    return scan_.Next();
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(fmt::format("{}: cannot be read: {}", path_, error.what()));
  }
}

const LogEvent* LogReader::Next() {
  while (const LogPiece* piece = NextPiece()) {
    read_bytes_ = piece->end();
    if (Take(*piece)) {
      event_ = {piece->header.utime, piece->channel, piece->data, piece->header.number};
      return &event_;
    }
  }
  CheckIsLog();
  return nullptr;
}

// Counts the piece. Returns whether it is an event for the caller of Next.
bool LogReader::Take(const LogPiece& piece) {
  if (piece.kind == LogPiece::Kind::kTornTail) {
    reading_.torn_bytes = piece.bytes;
  } else if (piece.kind == LogPiece::Kind::kDamage) {
    Lose(piece);
  } else if (FillsDamage(piece)) {
    Lose(piece);
    ++reading_.marked;
  } else {
    See(piece);
    const bool is_list = piece.channel == channels::kChecksums;
    ++(is_list ? reading_.checksums : reading_.events);
    return !is_list;
  }
  return false;
}

void LogReader::Lose(const LogPiece& piece) {
  reading_.lost_bytes += piece.bytes;
  if (piece.offset == lost_end_ && lost_open_) {
    reading_.listed.back().bytes += piece.bytes;
  } else if (piece.offset != lost_end_) {
    ++reading_.lost_places;
    lost_open_ = reading_.listed.size() < LogReading::kMaxListed;
    if (lost_open_) {
      reading_.listed.push_back({piece.offset, piece.bytes, last_, std::nullopt});
    }
  }
  lost_end_ = piece.end();
}

void LogReader::See(const LogPiece& event) {
  const int64_t utime = event.header.utime;
  first_utime_ = first_utime_.value_or(utime);
  last_ = {event.header.number, 1e-6 * static_cast<double>(utime - *first_utime_)};
  if (lost_open_) {
    reading_.listed.back().after = last_;
    lost_open_ = false;
  }
}

// A file without any whole event counts as a log only if it begins as an event does, because a log
// may be cut anywhere.
void LogReader::CheckIsLog() const {
  const int64_t bytes = scan_.file_bytes();
  if (bytes > 0 && !last_ && !BeginsAsLogEvent(fd_, 0, bytes)) {
    throw std::runtime_error(
        fmt::format("{}: is no LCM log: its {} bytes hold no whole event", path_, bytes));
  }
}

void ReadLog(const std::string& path, const std::function<void(const LogEvent&)>& handler,
             LogReadings* readings, WhileReading while_reading) {
  constexpr int64_t kMegabyte = 1'000'000;
  LogReader log(path);
  Progress progress("reading " + path);
  while (const LogEvent* event = log.Next()) {
    handler(*event);
    if (while_reading == WhileReading::kTellProgress) {
      progress.Update(log.read_bytes() / kMegabyte, log.file_bytes() / kMegabyte, "MB");
    }
  }
  if (readings != nullptr) {
    (*readings)[path] = log.reading();
  } else if (!log.reading().whole()) {
    throw std::runtime_error(fmt::format("{}: {}", path, DescribeLoss(log.reading())));
  }
}

}  // namespace pangea
