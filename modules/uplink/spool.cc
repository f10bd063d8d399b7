#include "uplink/spool.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <system_error>

#include "log_file/log_event.h"
#include "messages/channels.h"
#include "messages/messages.h"
#include "pangea/keyframe_t.hpp"

namespace pangea {
namespace {

namespace fs = std::filesystem;

constexpr char kPrefix[] = "keyframes_";
// keyframe_t begins with its fingerprint and its id (agent, map, seq).
constexpr size_t kIdBytes = 4 + 8 + 4;
using Begin8 = std::array<uint8_t, 8>;

// The id in a keyframe's first bytes, without decoding the rest.
std::optional<KeyframeId> IdOf(Bytes begin) {
  static const std::vector<uint8_t> fingerprint = [] {
    const keyframe_t empty{};
    std::vector<uint8_t> bytes = EncodeMessage(empty);
    bytes.resize(sizeof(Begin8));
    return bytes;
  }();
  keyframe_id_t id{};
  if (begin.size() < sizeof(Begin8) + kIdBytes ||
      !std::equal(fingerprint.begin(), fingerprint.end(), begin.begin()) ||
      id._decodeNoHash(begin.data(), sizeof(Begin8), kIdBytes) < 0) {
    return std::nullopt;
  }
  return Parse(id).value;
}

// The number in keyframes_000012.lcm.
std::optional<int64_t> NumberOf(const fs::path& file) {
  const std::string name = file.filename().string();
  if (!name.starts_with(kPrefix) || !name.ends_with(".lcm")) {
    return std::nullopt;
  }
  const std::string digits = name.substr(sizeof(kPrefix) - 1, name.size() - sizeof(kPrefix) - 3);
  const bool good = !digits.empty() && digits.size() < 12 &&
                    digits.find_first_not_of("0123456789") == std::string::npos;
  return good ? std::optional(std::stoll(digits)) : std::nullopt;
}

}  // namespace

Spool::Spool(fs::path folder, int32_t agent_id, int64_t max_bytes)
    : folder_(std::move(folder)), agent_id_(agent_id), max_bytes_(max_bytes) {
  std::error_code error;
  fs::create_directories(folder_, error);
  lock_ = open(folder_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (lock_ < 0) {
    throw std::runtime_error(
        fmt::format("cannot use the spool '{}': {}", folder_.string(), std::strerror(errno)));
  }
  if (flock(lock_, LOCK_EX | LOCK_NB) != 0) {
    Refuse("is in use by another process");
  }
  std::map<int64_t, fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder_, error)) {
    if (const auto number = NumberOf(entry.path())) {
      files[*number] = entry.path();
    }
  }
  for (const auto& [number, file] : files) {
    newest_ = number;
    Load(number);
    RemoveIfRead(number);
  }
}

Spool::~Spool() {
  CloseFile();
  close(lock_);
}

void Spool::Refuse(const std::string& reason) const {
  close(lock_);
  throw std::runtime_error(
      fmt::format("the spool '{}' {}: give each uplink its own --spool", folder_.string(), reason));
}

fs::path Spool::File(int64_t segment) const {
  return folder_ / fmt::format("{}{:06}.lcm", kPrefix, segment);
}

void Spool::Load(int64_t number) {
  Segment& segment = segments_[number];
  const int fd = open(File(number).c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) {
    return;
  }
  const int64_t file_bytes = lseek(fd, 0, SEEK_END);
  std::vector<uint8_t> start(LogEventHeader::kBytes), begin;
  for (int64_t at = 0; at < file_bytes;) {
    if (!ReadFully(fd, at, start.data(), start.size())) {
      break;
    }
    const auto header = ParseLogEventHeader(start);
    if (!header || at + header->event_bytes() > file_bytes) {
      break;
    }
    const int64_t data_at = at + header->event_bytes() - header->data_bytes;
    begin.resize(std::min<size_t>(static_cast<size_t>(header->data_bytes), 8 + kIdBytes));
    if (!ReadFully(fd, data_at, begin.data(), begin.size())) {
      break;
    }
    const auto id = IdOf(begin);
    if (id && id->map.agent_id != agent_id_) {
      close(fd);
      Refuse(fmt::format("holds keyframes of agent {}, this is agent {}", id->map.agent_id,
                         agent_id_));
    }
    if (id && places_.try_emplace(*id, Place{number, data_at, header->data_bytes}).second) {
      ++segment.kept;
    }
    at += header->event_bytes();
  }
  close(fd);
  segment.bytes = file_bytes;
  bytes_ += file_bytes;
}

bool Spool::Add(const KeyframeId& id, Bytes data, int64_t utime) {
  if (places_.contains(id)) {
    return true;
  }
  refuses_ = bytes_ + static_cast<int64_t>(data.size()) > max_bytes_ || !Write(id, data, utime);
  return !refuses_;
}

bool Spool::Write(const KeyframeId& id, Bytes data, int64_t utime) {
  if (fd_ < 0 || segments_.at(newest_).bytes >= kSegmentBytes) {
    CloseFile();
    fd_ = open(File(newest_ + 1).c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
    if (fd_ < 0) {
      return false;
    }
    segments_[++newest_] = {};
    next_event_ = 0;
    SyncFolder(folder_);
  }
  Segment& segment = segments_.at(newest_);
  std::vector<uint8_t> event;
  const size_t begin =
      AppendLogEvent(next_event_, utime, channels::Keyframe(agent_id_), data, &event);
  // A part that was written before the disk refused is written over by the next keyframe.
  if (!WriteFully(fd_, segment.bytes, event.data(), event.size())) {
    return false;
  }
  places_[id] = {newest_, segment.bytes + static_cast<int64_t>(begin),
                 static_cast<int32_t>(data.size())};
  ++next_event_;
  ++segment.kept;
  segment.bytes += static_cast<int64_t>(event.size());
  bytes_ += static_cast<int64_t>(event.size());
  unsynced_ = true;
  return true;
}

std::vector<uint8_t> Spool::Read(const KeyframeId& id) const {
  const auto place = places_.find(id);
  if (place == places_.end()) {
    return {};
  }
  std::vector<uint8_t> data(static_cast<size_t>(place->second.size));
  const int fd = open(File(place->second.segment).c_str(), O_RDONLY | O_CLOEXEC);
  const bool read = fd >= 0 && ReadFully(fd, place->second.offset, data.data(), data.size());
  if (fd >= 0) {
    close(fd);
  }
  // What a power cut left of it may be no keyframe.
  keyframe_t message{};
  const bool good = read && DecodeMessage(data, &message) && Parse(message).value.has_value();
  return good ? data : std::vector<uint8_t>{};
}

void Spool::Release(const MapId& map, int32_t seq) {
  auto it = places_.lower_bound({map, 0});
  while (it != places_.end() && it->first.map == map && it->first.seq <= seq) {
    const int64_t segment = it->second.segment;
    it = places_.erase(it);
    --segments_.at(segment).kept;
    RemoveIfRead(segment);
  }
}

void Spool::RemoveIfRead(int64_t number) {
  const Segment& segment = segments_.at(number);
  const bool written_to = number == newest_ && fd_ >= 0;
  if (segment.kept > 0 || (written_to && segment.bytes < kLeastSegmentBytes)) {
    return;
  }
  if (written_to) {
    CloseFile();
  }
  std::error_code error;
  fs::remove(File(number), error);
  bytes_ -= segment.bytes;
  segments_.erase(number);
}

void Spool::CloseFile() {
  Sync();
  if (fd_ >= 0) {
    close(fd_);
    fd_ = -1;
  }
}

void Spool::Sync() {
  if (unsynced_ && fd_ >= 0) {
    fdatasync(fd_);
  }
  unsynced_ = false;
}

std::vector<KeyframeId> Spool::Kept() const {
  std::vector<KeyframeId> kept;
  for (const auto& [id, place] : places_) {
    kept.push_back(id);
  }
  return kept;
}

}  // namespace pangea
