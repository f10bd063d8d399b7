#pragma once

// A tar archive (POSIX ustar) compressed with zstd; `tar --zstd -xf` also unpacks it. Only regular
// files.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/bytes.h"

namespace pangea::site {

class ArchiveFileWriter {
 public:
  // Here and below: throws std::runtime_error if the file exists or cannot be written.
  explicit ArchiveFileWriter(const std::filesystem::path& path);
  ~ArchiveFileWriter();

  // Begins a file; then call Write, in parts, with exactly `bytes` bytes. `name`: at most 99 bytes.
  // `mode`: permissions, such as 0600.
  void Begin(const std::string& name, int64_t bytes, int mode, int64_t utime);
  void Write(Bytes part);
  // Flushes everything to the disk.
  void Finish();

 private:
  struct Stream;
  void Pad();

  std::unique_ptr<Stream> stream_;
  int64_t left_ = 0;     // bytes left of the present file
  int64_t padding_ = 0;  // bytes of padding after it
};

struct ArchivedFile {
  std::string name;
  int64_t bytes = 0;
  int mode = 0;
};

class ArchiveFileReader {
 public:
  // Here and below: throws std::runtime_error if the file cannot be read, is no such archive, or is
  // damaged.
  explicit ArchiveFileReader(const std::filesystem::path& path);
  ~ArchiveFileReader();

  // The next file; empty at the end of the archive.
  std::optional<ArchivedFile> Next();
  // The next part of the present file, empty at its end. Valid until the next call.
  Bytes Read();

 private:
  struct Stream;

  std::unique_ptr<Stream> stream_;
  int64_t left_ = 0;
  int64_t padding_ = 0;
  std::vector<uint8_t> part_;
};

}  // namespace pangea::site
