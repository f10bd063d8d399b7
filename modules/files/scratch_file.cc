#include "files/scratch_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <system_error>

#include "files/disk_io.h"

namespace pangea {
namespace {

std::string FolderOf(const ScratchFileOptions& options) {
  if (!options.folder.empty()) {
    return options.folder;
  }
  const char* const folder = std::getenv("TMPDIR");
  return folder != nullptr && *folder != '\0' ? folder : "/var/tmp";
}

std::string Reason() { return std::generic_category().message(errno); }

// The file has no name from the start if the file system supports that; else its name is removed at
// once.
int OpenWithoutName(const std::string& folder) {
  const int file = open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
  if (file >= 0 || (errno != EOPNOTSUPP && errno != EISDIR)) {
    return file;
  }
  std::string path = folder + "/pangea-XXXXXX";
  const int named = mkostemp(path.data(), O_CLOEXEC);
  if (named >= 0) {
    unlink(path.c_str());
  }
  return named;
}

}  // namespace

ScratchFile::ScratchFile(const ScratchFileOptions& options)
    : folder_(FolderOf(options)), max_bytes_(options.max_bytes), file_(OpenWithoutName(folder_)) {
  if (file_ < 0) {
    throw std::runtime_error(
        fmt::format("{}: no scratch file can be made there: {}; TMPDIR names another folder",
                    folder_, Reason()));
  }
}

ScratchFile::~ScratchFile() { close(file_); }

std::optional<int64_t> ScratchFile::Append(std::span<const uint8_t> record) {
  const auto size = static_cast<int64_t>(record.size());
  if (size > max_bytes_ - end_) {
    problem_ = fmt::format("the scratch file in {} holds all of its {} MB", folder_,
                           max_bytes_ / 1'000'000);
    return std::nullopt;
  }
  if (!WriteFully(file_, end_, record.data(), record.size())) {
    problem_ = fmt::format("the scratch file in {} cannot be written: {}", folder_, Reason());
    return std::nullopt;
  }
  const int64_t offset = end_;
  end_ += size;
  return offset;
}

bool ScratchFile::Read(int64_t offset, std::span<uint8_t> record) {
  if (ReadFully(file_, offset, record.data(), record.size())) {
    return true;
  }
  problem_ = fmt::format("the scratch file in {} cannot be read: {}", folder_,
                         errno == 0 ? "it ends too early" : Reason());
  return false;
}

}  // namespace pangea
