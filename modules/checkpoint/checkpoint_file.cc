#include "checkpoint/checkpoint_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "files/disk_io.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;

constexpr uint64_t kMagic = 0x54504b4341474e50;  // "PNGACKPT"
constexpr uint32_t kFileFormat = 1;
constexpr size_t kBufferBytes = 1 << 20;
// The tail of the file: the number of bytes before it, and their CRC-32.
constexpr int64_t kTailBytes = sizeof(int64_t) + sizeof(uint32_t);

uint32_t Checksum(uint32_t of_bytes_before, const std::vector<uint8_t>& bytes) {
  return static_cast<uint32_t>(crc32_z(of_bytes_before, bytes.data(), bytes.size()));
}

void Put(const std::string& text, ByteWriter* writer) {
  writer->Put(std::vector<char>(text.begin(), text.end()));
}

std::string GetText(ByteReader* reader) {
  std::vector<char> text;
  reader->Get(&text);
  return {text.begin(), text.end()};
}

}  // namespace

CheckpointWriter::CheckpointWriter(const fs::path& file, const CheckpointKey& key,
                                   const JournalState& journal)
    : file_(file), made_(fmt::format("{}.new", file.string())) {
  fs::create_directories(fs::absolute(file).parent_path());
  fd_ = open(made_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (fd_ < 0) {
    Fail();
  }
  Put(kMagic);
  Put(kFileFormat);
  pangea::Put(key.process, this);
  Put(key.format);
  pangea::Put(key.options, this);
  Put(journal.num_bytes);
  Put(journal.last_event_offset);
  Put(journal.last_event_crc32);
}

CheckpointWriter::~CheckpointWriter() {
  if (fd_ >= 0) {
    close(fd_);
    unlink(made_.c_str());
  }
}

void CheckpointWriter::Fail() const {
  throw std::runtime_error(
      fmt::format("{}: cannot be written: {}", file_.string(), std::strerror(errno)));
}

void CheckpointWriter::PutBytes(const void* data, size_t size) {
  const auto* const first = static_cast<const uint8_t*>(data);
  buffer_.insert(buffer_.end(), first, first + size);
  if (buffer_.size() >= kBufferBytes) {
    Flush();
  }
}

void CheckpointWriter::Flush() {
  crc32_ = Checksum(crc32_, buffer_);
  for (size_t written = 0; written < buffer_.size();) {
    const ssize_t count = write(fd_, buffer_.data() + written, buffer_.size() - written);
    if (count < 0 && errno != EINTR) {
      Fail();
    }
    written += static_cast<size_t>(std::max<ssize_t>(count, 0));
  }
  num_bytes_ += static_cast<int64_t>(buffer_.size());
  buffer_.clear();
}

void CheckpointWriter::Commit() {
  Flush();
  const int64_t num_bytes = num_bytes_;
  const uint32_t crc32 = crc32_;
  Put(num_bytes);
  Put(crc32);
  Flush();
  if (fsync(fd_) != 0 || rename(made_.c_str(), file_.c_str()) != 0) {
    Fail();
  }
  close(fd_);
  fd_ = -1;
  SyncToDisk(fs::absolute(file_).parent_path());
}

CheckpointReader::CheckpointReader(const fs::path& file, const CheckpointKey& key)
    : CheckpointReader(file) {
  if (head_.key.process != key.process) {
    throw std::runtime_error(fmt::format("it is one of {}", head_.key.process));
  }
  if (head_.key.format != key.format) {
    throw std::runtime_error("it is of another version");
  }
  if (head_.key.options != key.options) {
    throw std::runtime_error("it was made with other options");
  }
}

CheckpointReader::CheckpointReader(const fs::path& file) {
  fd_ = open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (fd_ < 0) {
    throw std::runtime_error(std::strerror(errno));
  }
  try {
    CheckWhole();
    ReadHead();
  } catch (...) {
    close(fd_);
    throw;
  }
}

CheckpointReader::~CheckpointReader() { close(fd_); }

void CheckpointReader::CheckWhole() {
  struct stat info {};
  if (fstat(fd_, &info) != 0 || !S_ISREG(info.st_mode)) {
    throw std::runtime_error("it is no file");
  }
  end_ = std::max<int64_t>(info.st_size - kTailBytes, 0);
  uint32_t computed = 0;
  std::vector<uint8_t> piece(kBufferBytes);
  for (int64_t at = 0; at < end_; at += static_cast<int64_t>(piece.size())) {
    piece.resize(std::min(piece.size(), static_cast<size_t>(end_ - at)));
    if (!ReadFully(fd_, at, piece.data(), piece.size())) {
      throw std::runtime_error(std::strerror(errno));
    }
    computed = Checksum(computed, piece);
  }
  int64_t num_bytes = 0;
  uint32_t written = 0;
  if (!ReadFully(fd_, end_, &num_bytes, sizeof(num_bytes)) ||
      !ReadFully(fd_, end_ + static_cast<int64_t>(sizeof(num_bytes)), &written, sizeof(written)) ||
      num_bytes != end_) {
    throw std::runtime_error("it is torn");
  }
  if (written != computed) {
    throw std::runtime_error("it is damaged");
  }
}

void CheckpointReader::ReadHead() {
  uint64_t magic = 0;
  uint32_t file_format = 0;
  Get(&magic);
  Get(&file_format);
  if (magic != kMagic || file_format != kFileFormat) {
    throw std::runtime_error("it is of another version");
  }
  head_.key.process = GetText(this);
  Get(&head_.key.format);
  head_.key.options = GetText(this);
  Get(&head_.journal.num_bytes);
  Get(&head_.journal.last_event_offset);
  Get(&head_.journal.last_event_crc32);
}

bool CheckpointReader::Read(void* data, size_t size) {
  const auto buffered = static_cast<int64_t>(buffer_.size());
  if (at_ + static_cast<int64_t>(size) > buffer_at_ + buffered) {
    if (size >= kBufferBytes) {
      const bool read = ReadFully(fd_, at_, data, size);
      at_ += static_cast<int64_t>(size);
      buffer_at_ = at_;
      buffer_.clear();
      return read;
    }
    buffer_.resize(std::min(kBufferBytes, bytes_left()));
    buffer_at_ = at_;
    if (!ReadFully(fd_, at_, buffer_.data(), buffer_.size())) {
      return false;
    }
  }
  if (size > 0) {  // `data` of nothing may be null
    std::memcpy(data, buffer_.data() + (at_ - buffer_at_), size);
  }
  at_ += static_cast<int64_t>(size);
  return true;
}

}  // namespace pangea
