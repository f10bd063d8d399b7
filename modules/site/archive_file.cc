#include "site/archive_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <numeric>
#include <stdexcept>

#include "files/disk_io.h"
#include "log_file/log_event.h"

namespace pangea::site {
namespace {

// ustar's header: POSIX.1-2017, pax, "ustar Interchange Format".
constexpr size_t kBlock = 512;
constexpr size_t kMaxName = 99;
constexpr size_t kPart = 1 << 20;
constexpr int64_t kMaxOctal = (int64_t{1} << 33) - 1;  // eleven digits
using Block = std::array<uint8_t, kBlock>;

int64_t PaddingOf(int64_t bytes) {
  return (static_cast<int64_t>(kBlock) - bytes % static_cast<int64_t>(kBlock)) %
         static_cast<int64_t>(kBlock);
}

void PutText(Block* block, size_t at, const std::string& text) {
  std::ranges::copy(text, block->begin() + static_cast<int64_t>(at));
}

// Sizes of 8 GiB and more use GNU's binary numbers, which all tars read.
void PutSize(Block* block, int64_t bytes) {
  if (bytes <= kMaxOctal) {
    return PutText(block, 124, fmt::format("{:011o}", bytes));
  }
  (*block)[124] = 0x80;
  for (size_t i = 0; i < 8; ++i) {
    (*block)[128 + i] = static_cast<uint8_t>(bytes >> (8 * (7 - i)));
  }
}

// The header's checksum; its own eight bytes count as blanks.
uint32_t ChecksumOf(Block block) {
  std::fill_n(block.begin() + 148, 8, uint8_t{' '});
  return std::accumulate(block.begin(), block.end(), uint32_t{0});
}

Block HeaderOf(const std::string& name, int64_t bytes, int mode, int64_t utime) {
  Block block{};
  PutText(&block, 0, name);
  PutText(&block, 100, fmt::format("{:07o}", mode));
  PutText(&block, 108, "0000000");
  PutText(&block, 116, "0000000");
  PutSize(&block, bytes);
  PutText(&block, 136, fmt::format("{:011o}", utime / 1'000'000));
  block[156] = '0';
  PutText(&block, 257, "ustar");
  PutText(&block, 263, "00");
  PutText(&block, 148, fmt::format("{:06o}", ChecksumOf(block)));
  block[155] = ' ';
  return block;
}

// -1 if it is not a number.
int64_t GetOctal(const Block& block, size_t at, size_t size) {
  int64_t value = 0;
  for (size_t i = at; i < at + size && block[i] != 0 && block[i] != ' '; ++i) {
    if (block[i] < '0' || block[i] > '7') {
      return -1;
    }
    value = 8 * value + (block[i] - '0');
  }
  return value;
}

int64_t GetSize(const Block& block) {
  if (block[124] != 0x80) {
    return GetOctal(block, 124, 12);
  }
  int64_t value = 0;
  for (size_t i = 0; i < 8; ++i) {
    value = value << 8 | block[128 + i];
  }
  return value;
}

[[noreturn]] void Refuse(const std::string& path, const std::string& what) {
  throw std::runtime_error(fmt::format("{}: {}", path, what));
}

}  // namespace

struct ArchiveFileWriter::Stream {
  std::string path;
  int fd = -1;
  int64_t at = 0;
  ZSTD_CCtx* zstd = ZSTD_createCCtx();
  std::vector<uint8_t> out = std::vector<uint8_t>(ZSTD_CStreamOutSize());

  ~Stream() {
    ZSTD_freeCCtx(zstd);
    close(fd);
  }

  void Write(Bytes bytes, ZSTD_EndDirective end) {
    ZSTD_inBuffer in{bytes.data(), bytes.size(), 0};
    bool done = false;
    while (!done) {
      ZSTD_outBuffer to{out.data(), out.size(), 0};
      const size_t left = ZSTD_compressStream2(zstd, &to, &in, end);
      if (ZSTD_isError(left) != 0) {
        Refuse(path, fmt::format("cannot be compressed: {}", ZSTD_getErrorName(left)));
      }
      if (!WriteFully(fd, at, out.data(), to.pos)) {
        Refuse(path, fmt::format("cannot be written: {}", std::strerror(errno)));
      }
      at += static_cast<int64_t>(to.pos);
      done = end == ZSTD_e_end ? left == 0 : in.pos == in.size;
    }
  }
};

ArchiveFileWriter::ArchiveFileWriter(const std::filesystem::path& path)
    : stream_(std::make_unique<Stream>()) {
  stream_->path = path.string();
  stream_->fd = open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (stream_->fd < 0) {
    Refuse(stream_->path, fmt::format("cannot be made: {}", std::strerror(errno)));
  }
  ZSTD_CCtx_setParameter(stream_->zstd, ZSTD_c_checksumFlag, 1);
}

ArchiveFileWriter::~ArchiveFileWriter() = default;

void ArchiveFileWriter::Begin(const std::string& name, int64_t bytes, int mode, int64_t utime) {
  if (name.size() > kMaxName) {
    Refuse(stream_->path, fmt::format("'{}' is too long a name", name));
  }
  Pad();
  stream_->Write(HeaderOf(name, bytes, mode, utime), ZSTD_e_continue);
  left_ = bytes;
  padding_ = PaddingOf(bytes);
}

void ArchiveFileWriter::Write(Bytes part) {
  left_ -= std::ssize(part);
  stream_->Write(part, ZSTD_e_continue);
}

void ArchiveFileWriter::Pad() {
  if (left_ != 0) {
    Refuse(stream_->path, "a file changed its length while it was written");
  }
  stream_->Write(std::vector<uint8_t>(static_cast<size_t>(padding_)), ZSTD_e_continue);
  padding_ = 0;
}

void ArchiveFileWriter::Finish() {
  Pad();
  stream_->Write(std::vector<uint8_t>(2 * kBlock), ZSTD_e_end);
  if (fsync(stream_->fd) != 0) {
    Refuse(stream_->path, fmt::format("cannot be written: {}", std::strerror(errno)));
  }
}

struct ArchiveFileReader::Stream {
  std::string path;
  int fd = -1;
  int64_t at = 0;
  ZSTD_DCtx* zstd = ZSTD_createDCtx();
  std::vector<uint8_t> bytes;
  ZSTD_inBuffer in{nullptr, 0, 0};

  ~Stream() {
    ZSTD_freeDCtx(zstd);
    close(fd);
  }

  void Fill() {
    bytes.resize(ZSTD_DStreamInSize());
    const ssize_t size = pread(fd, bytes.data(), bytes.size(), at);
    if (size <= 0) {
      Refuse(path, size == 0 ? "ends in the middle: is it copied to its end?"
                             : fmt::format("cannot be read: {}", std::strerror(errno)));
    }
    at += size;
    in = {bytes.data(), static_cast<size_t>(size), 0};
  }

  // Returns 0 at the end of the data.
  size_t Decompress(ZSTD_outBuffer* out) {
    if (in.pos == in.size) {
      Fill();
    }
    const size_t left = ZSTD_decompressStream(zstd, out, &in);
    if (ZSTD_isError(left) != 0) {
      Refuse(path, fmt::format("is no backup, or damaged ({})", ZSTD_getErrorName(left)));
    }
    return left;
  }

  void Read(uint8_t* data, size_t size) {
    ZSTD_outBuffer out{data, size, 0};
    while (out.pos < out.size) {
      if (Decompress(&out) == 0 && out.pos < out.size) {
        Refuse(path, "ends in the middle: is it copied to its end?");
      }
    }
  }

  // Reads to the end, so that the checksum there is verified.
  void ReadToEnd() {
    Block rest{};
    for (size_t left = 1; left != 0;) {
      ZSTD_outBuffer out{rest.data(), rest.size(), 0};
      left = Decompress(&out);
    }
  }
};

ArchiveFileReader::ArchiveFileReader(const std::filesystem::path& path)
    : stream_(std::make_unique<Stream>()) {
  stream_->path = path.string();
  stream_->fd = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (stream_->fd < 0) {
    Refuse(stream_->path, fmt::format("cannot be opened: {}", std::strerror(errno)));
  }
}

ArchiveFileReader::~ArchiveFileReader() = default;

std::optional<ArchivedFile> ArchiveFileReader::Next() {
  while (!Read().empty()) {
  }
  std::vector<uint8_t> padding(static_cast<size_t>(padding_));
  stream_->Read(padding.data(), padding.size());
  padding_ = 0;
  Block block{};
  stream_->Read(block.data(), block.size());
  if (std::ranges::all_of(block, [](uint8_t byte) { return byte == 0; })) {
    stream_->ReadToEnd();
    return std::nullopt;
  }
  ArchivedFile file;
  file.name.assign(block.begin(), std::find(block.begin(), block.begin() + kMaxName, 0));
  file.bytes = GetSize(block);
  file.mode = static_cast<int>(GetOctal(block, 100, 8));
  if (GetOctal(block, 148, 8) != ChecksumOf(block) || file.bytes < 0 || file.mode < 0) {
    Refuse(stream_->path, "is no tar archive, or damaged");
  }
  if (block[156] != '0') {
    Refuse(stream_->path,
           fmt::format("'{}' in it is no plain file: it was not made by pangea-site backup",
                       file.name));
  }
  left_ = file.bytes;
  padding_ = PaddingOf(file.bytes);
  return file;
}

Bytes ArchiveFileReader::Read() {
  part_.resize(static_cast<size_t>(std::min<int64_t>(left_, kPart)));
  stream_->Read(part_.data(), part_.size());
  left_ -= std::ssize(part_);
  return part_;
}

}  // namespace pangea::site
