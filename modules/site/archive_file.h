#pragma once

// Files in one: a tar archive (POSIX ustar) compressed with zstd, so that `tar --zstd -xf` unpacks
// it too. Regular files alone.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bus/bus.h"

namespace pangea::site {

class ArchiveFileWriter {
 public:
  // Throws std::runtime_error, here and below: the file exists, cannot be written.
  explicit ArchiveFileWriter(const std::filesystem::path& path);
  ~ArchiveFileWriter();

  // Then exactly `bytes` bytes of it, in parts. `name`: at most 99 bytes; `mode`: 0600 and its
  // like.
  void Begin(const std::string& name, int64_t bytes, int mode, int64_t utime);
  void Write(Bytes part);
  // All is on the disk when it returns.
  void Finish();

 private:
  struct Stream;
  void Pad();

  std::unique_ptr<Stream> stream_;
  int64_t left_ = 0;     // of the file that was begun
  int64_t padding_ = 0;  // behind it
};

struct ArchivedFile {
  std::string name;
  int64_t bytes = 0;
  int mode = 0;
};

class ArchiveFileReader {
 public:
  // Throws std::runtime_error, here and below: cannot be read, is no such archive, is damaged.
  explicit ArchiveFileReader(const std::filesystem::path& path);
  ~ArchiveFileReader();

  // The next file; nothing at the archive's end.
  std::optional<ArchivedFile> Next();
  // The next part of it, empty at its end. Valid until the next call.
  Bytes Read();

 private:
  struct Stream;

  std::unique_ptr<Stream> stream_;
  int64_t left_ = 0;
  int64_t padding_ = 0;
  std::vector<uint8_t> part_;
};

}  // namespace pangea::site
