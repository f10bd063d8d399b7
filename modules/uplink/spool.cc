#include "uplink/spool.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <iostream>
#include <stdexcept>
#include <system_error>

#include "files/disk_io.h"
#include "log_file/checksums.h"
#include "log_file/damaged_copy.h"
#include "log_file/log_event.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/messages.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;

constexpr char kPrefix[] = "keyframes_";
// An encoded keyframe begins with its fingerprint and its id (agent, map, seq).
constexpr size_t kIdBytes = 4 + 8 + 4;
using Begin8 = std::array<uint8_t, 8>;

// The id in a keyframe's first bytes, without decoding the rest.
std::optional<KeyframeId> IdOf(Bytes begin) {
  keyframe_id_t id{};
  if (begin.size() < sizeof(Begin8) + kIdBytes || !KeyframeMessage::BeginsOne(begin.data()) ||
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
  FindFiles();
  for (const auto& [number, segment] : std::map(segments_)) {
    newest_ = number;
    Load(number);
    RemoveIfRead(number);
  }
}

void Spool::FindFiles() {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder_, error)) {
    if (const auto number = NumberOf(entry.path())) {
      segments_[*number] = {};
    } else if (entry.path().filename().string().find(".lcm.damaged-") != std::string::npos) {
      damaged_bytes_ += static_cast<int64_t>(entry.file_size(error));
    }
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

void Spool::NoteDamage(int64_t number, const std::string& what) {
  segments_.at(number).damaged = true;
  ++num_damaged_;
  std::cerr << fmt::format("the spool's '{}' IS DAMAGED: {}; the file stays when it is done with\n",
                           File(number).string(), what);
}

void Spool::Load(int64_t number) {
  const int fd = open(File(number).c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) {
    return NoteDamage(number, std::strerror(errno));
  }
  try {
    LoadFrom(fd, number);
  } catch (...) {
    close(fd);
    throw;
  }
  close(fd);
}

void Spool::LoadFrom(int fd, int64_t number) {
  CheckedScan scan(fd);
  segments_.at(number).bytes = scan.file_bytes();
  bytes_ += scan.file_bytes();
  // What the disk cannot read, and all behind it, is damage.
  const auto next = [&]() -> const CheckedScan::Piece* {
    try {
      return scan.Next();
    } catch (const std::runtime_error& error) {
      NoteDamage(number, error.what());
      return nullptr;
    }
  };
  while (const CheckedScan::Piece* piece = next()) {
    if (piece->kind == LogPiece::Kind::kEvent) {
      LoadEvent(number, *piece);
    } else if (piece->kind == LogPiece::Kind::kDamage ||
               !BeginsAsLogEvent(fd, piece->offset, piece->bytes)) {
      NoteDamage(number, fmt::format("{} bytes at byte {}", piece->bytes, piece->offset));
    }
  }
}

void Spool::LoadEvent(int64_t number, const CheckedScan::Piece& event) {
  const auto id = IdOf(event.data);
  if (id && id->map.agent_id != agent_id_) {
    Refuse(
        fmt::format("holds keyframes of agent {}, this is agent {}", id->map.agent_id, agent_id_));
  }
  const Place place{number, event.offset, static_cast<int32_t>(event.bytes), event.crc32()};
  if (id && places_.try_emplace(*id, place).second) {
    ++segments_.at(number).kept;
  } else if (!id && event.channel == channels::Keyframe(agent_id_)) {
    NoteDamage(number, fmt::format("the keyframe at byte {}", event.offset));
  }
}

bool Spool::Add(const KeyframeId& id, Bytes data, int64_t utime) {
  if (places_.contains(id)) {
    return true;
  }
  const int64_t needed = bytes_ + damaged_bytes_ + static_cast<int64_t>(data.size());
  refuses_ = needed > max_bytes_ || !Write(id, data, utime);
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
    TrySyncToDisk(folder_);
  }
  Segment& segment = segments_.at(newest_);
  std::vector<uint8_t> bytes;
  AppendLogEvent(next_event_, utime, channels::Keyframe(agent_id_), data, &bytes);
  const Place place{newest_, segment.bytes, static_cast<int32_t>(bytes.size()),
                    EventChecksum(bytes)};
  AppendChecksumsEvent({next_event_, {place.crc32}}, utime, &bytes);
  if (!WriteFully(fd_, segment.bytes, bytes.data(), bytes.size())) {
    // The next event may be shorter than the part that was written, whose rest would be damage. If
    // it cannot be cut off, that is all it is.
    [[maybe_unused]] const int ignored = ftruncate(fd_, segment.bytes);
    return false;
  }
  places_[id] = place;
  next_event_ += 2;
  ++segment.kept;
  segment.bytes += static_cast<int64_t>(bytes.size());
  bytes_ += static_cast<int64_t>(bytes.size());
  unsynced_ = true;
  return true;
}

std::vector<uint8_t> Spool::Read(const KeyframeId& id) {
  const auto found = places_.find(id);
  if (found == places_.end()) {
    return {};
  }
  const Place place = found->second;
  std::vector<uint8_t> data = ReadData(place);
  KeyframeMessage message{};
  if (DecodeMessage(data, &message) && Parse(message).value.has_value()) {
    return data;
  }
  NoteDamage(place.segment, fmt::format("the keyframe at byte {}", place.offset));
  places_.erase(found);
  --segments_.at(place.segment).kept;
  RemoveIfRead(place.segment);
  return {};
}

// The data of the event; empty if it cannot be read or its checksum is wrong.
std::vector<uint8_t> Spool::ReadData(const Place& place) const {
  std::vector<uint8_t> event(static_cast<size_t>(place.size));
  const int fd = open(File(place.segment).c_str(), O_RDONLY | O_CLOEXEC);
  const bool read = fd >= 0 && ReadFully(fd, place.offset, event.data(), event.size());
  if (fd >= 0) {
    close(fd);
  }
  const auto header = ParseLogEventHeader(event);
  if (!read || !header || EventChecksum(event) != place.crc32) {
    return {};
  }
  return {event.end() - header->data_bytes, event.end()};
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
  if (segment.kept > 0 || (written_to && segment.bytes < kMinSegmentBytes)) {
    return;
  }
  if (written_to) {
    CloseFile();
  }
  Remove(number);
}

void Spool::Remove(int64_t number) {
  const Segment& segment = segments_.at(number);
  std::error_code error;
  if (segment.damaged) {
    fs::rename(File(number), DamagedName(File(number).string()), error);
    damaged_bytes_ += segment.bytes;
  } else {
    fs::remove(File(number), error);
  }
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
