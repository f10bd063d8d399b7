#include "files/whole_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <string>

#include "files/disk_io.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void Fail(const fs::path& path, const char* what, int error) {
  throw std::runtime_error(fmt::format("{}: {}: {}", path.string(), what, std::strerror(error)));
}

fs::path FolderOf(const fs::path& file) { return fs::absolute(file).parent_path(); }

// A temporary file beside the final one. The destructor removes the temporary name.
class FileInTheMaking {
 public:
  FileInTheMaking(const fs::path& file, std::string_view text, mode_t mode)
      : path_(fmt::format("{}.new-{}", file.string(), getpid())) {
    unlink(path_.c_str());
    const int fd = open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode);
    if (fd < 0) {
      Fail(file, "cannot be written", errno);
    }
    errno = 0;
    const bool written =
        fchmod(fd, mode) == 0 && WriteFully(fd, 0, text.data(), text.size()) && fsync(fd) == 0;
    const int error = errno;
    if (close(fd) != 0 || !written) {
      unlink(path_.c_str());
      Fail(file, "cannot be written", error == 0 ? ENOSPC : error);
    }
  }
  ~FileInTheMaking() { unlink(path_.c_str()); }
  FileInTheMaking(const FileInTheMaking&) = delete;
  FileInTheMaking& operator=(const FileInTheMaking&) = delete;

  const fs::path& path() const { return path_; }

 private:
  const fs::path path_;
};

}  // namespace

bool WriteNewFile(const fs::path& file, std::string_view text, mode_t mode) {
  const FileInTheMaking made(file, text, mode);
  if (link(made.path().c_str(), file.c_str()) != 0) {
    if (errno == EEXIST) {
      return false;
    }
    Fail(file, "cannot be written", errno);
  }
  SyncToDisk(FolderOf(file));
  return true;
}

void ReplaceFile(const fs::path& file, std::string_view text, mode_t mode) {
  const FileInTheMaking made(file, text, mode);
  if (rename(made.path().c_str(), file.c_str()) != 0) {
    Fail(file, "cannot be written", errno);
  }
  SyncToDisk(FolderOf(file));
}

bool RemoveFile(const fs::path& file) {
  if (unlink(file.c_str()) != 0) {
    if (errno == ENOENT) {
      return false;
    }
    Fail(file, "cannot be removed", errno);
  }
  SyncToDisk(FolderOf(file));
  return true;
}

}  // namespace pangea
