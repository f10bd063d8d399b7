#include "site/backup.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <boost/crc.hpp>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <stdexcept>

#include "files/disk_io.h"
#include "files/progress.h"
#include "log_file/log_event.h"
#include "site/archive_file.h"
#include "site/site_files.h"

namespace pangea::site {
namespace {

namespace fs = std::filesystem;

constexpr const char* kArchiveEnd = ".tar.zst";
constexpr const char* kTop = "site/";  // folder name in the archive
constexpr int64_t kCopiedPart = 1 << 20;
constexpr int64_t kMegabyte = 1'000'000;

// A file to copy, and how many bytes of it.
struct Source {
  std::string name;  // relative to the site's folder
  fs::path path;
  int64_t bytes = 0;
  int mode = 0;
};

// By file name; to compare the copy with the original.
using Checksums = std::map<std::string, uint32_t>;
// Call begin(file), then write(part) until the file is complete.
struct Target {
  std::function<void(const Source&)> begin;
  std::function<void(Bytes)> write;
};

bool IsArchive(const fs::path& path) { return path.string().ends_with(kArchiveEnd); }

Source SourceOf(const fs::path& path, const std::string& name) {
  return {name, path, static_cast<int64_t>(fs::file_size(path)),
          static_cast<int>(fs::status(path).permissions() & fs::perms::all)};
}

std::vector<Source> SourcesOf(const Site& site, bool with_keys, const WholePart& journal) {
  std::vector<Source> sources{SourceOf(site.file(), "site.yaml")};
  const auto add = [&sources](const std::vector<fs::path>& files, const std::string& folder) {
    for (const fs::path& file : files) {
      sources.push_back(SourceOf(file, folder + file.filename().string()));
    }
  };
  if (fs::exists(site.tags())) {
    add({site.tags()}, "");
  }
  add(OptionFiles(site), "options/");
  add(GatewayAgentFiles(site), "gateway/agents/");
  if (with_keys) {
    add(KeyFiles(site), "keys/");
    add(GatewayIdentityFiles(site), "gateway/");
  }
  if (fs::exists(site.journal())) {
    sources.push_back(SourceOf(site.journal(), "journal.lcm"));
    sources.back().bytes = journal.bytes;
  }
  return sources;
}

// What the journal has behind its whole part: a running server is still writing it, else it is
// lost.
int64_t LostBehind(const WholePart& journal, const Site& site) {
  return UserOf(site) || !fs::exists(site.journal())
             ? 0
             : static_cast<int64_t>(fs::file_size(site.journal())) - journal.bytes;
}

uint32_t CopyFile(const Source& source, const Target& target) {
  const int fd = open(source.path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) {
    throw std::runtime_error(
        fmt::format("{}: cannot be opened: {}", source.path.string(), std::strerror(errno)));
  }
  const std::unique_ptr<const int, void (*)(const int*)> closer(&fd,
                                                                [](const int* f) { close(*f); });
  Progress progress("copying " + source.path.string());
  boost::crc_32_type crc;
  std::vector<uint8_t> part;
  for (int64_t at = 0; at < source.bytes; at += std::ssize(part)) {
    part.resize(static_cast<size_t>(std::min(kCopiedPart, source.bytes - at)));
    if (!ReadFully(fd, at, part.data(), part.size())) {
      throw std::runtime_error(fmt::format("{}: cannot be read to its end", source.path.string()));
    }
    crc.process_bytes(part.data(), part.size());
    target.write(part);
    progress.Update(at / kMegabyte, source.bytes / kMegabyte, "MB");
  }
  return crc.checksum();
}

Checksums CopyFiles(const std::vector<Source>& sources, const Target& target) {
  Checksums checksums;
  for (const Source& source : sources) {
    target.begin(source);
    checksums[source.name] = CopyFile(source, target);
  }
  return checksums;
}

// Writes a new file part by part.
class NewFile {
 public:
  NewFile(const fs::path& path, int mode)
      : path_(path), fd_(open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600)) {
    if (fd_ < 0 || fchmod(fd_, static_cast<mode_t>(mode & 0777)) != 0) {
      throw std::runtime_error(
          fmt::format("{}: cannot be made: {}", path.string(), std::strerror(errno)));
    }
  }
  ~NewFile() { close(fd_); }
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;

  void Write(Bytes part) {
    if (!WriteFully(fd_, at_, part.data(), part.size())) {
      throw std::runtime_error(
          fmt::format("{}: cannot be written: {}", path_.string(), std::strerror(errno)));
    }
    at_ += std::ssize(part);
  }

 private:
  const fs::path path_;
  const int fd_;
  int64_t at_ = 0;
};

fs::path MakeRoomFor(const fs::path& folder, const std::string& name) {
  fs::path path = folder / name;
  fs::create_directories(path.parent_path());
  return path;
}

Checksums CopyToFolder(const std::vector<Source>& sources, const fs::path& folder) {
  std::unique_ptr<NewFile> file;
  return CopyFiles(sources, {[&](const Source& source) {
                               file = std::make_unique<NewFile>(MakeRoomFor(folder, source.name),
                                                                source.mode);
                             },
                             [&](Bytes part) { file->Write(part); }});
}

// Passes each file of the archive to `target`, part by part.
Checksums ReadArchive(const fs::path& from, const Target& target) {
  Checksums checksums;
  ArchiveFileReader reader(from);
  Progress progress("reading " + from.string());
  while (const auto file = reader.Next()) {
    const std::string name =
        file->name.starts_with(kTop) ? file->name.substr(std::strlen(kTop)) : file->name;
    if (!IsFileOfSite(name)) {
      throw std::runtime_error(
          fmt::format("{}: '{}' in it is no file of a site: it was not made by pangea-site backup",
                      from.string(), file->name));
    }
    target.begin({name, {}, file->bytes, file->mode});
    boost::crc_32_type crc;
    int64_t done = 0;
    for (Bytes part = reader.Read(); !part.empty(); part = reader.Read()) {
      crc.process_bytes(part.data(), part.size());
      target.write(part);
      done += std::ssize(part);
      progress.Update(done / kMegabyte, file->bytes / kMegabyte, "MB");
    }
    checksums[name] = crc.checksum();
  }
  return checksums;
}

void CheckWritten(const Checksums& read, const Checksums& written, const fs::path& to) {
  if (read != written) {
    throw std::runtime_error(fmt::format(
        "{}: what was written is not what was read; is the disk all right?", to.string()));
  }
}

// An archive file that gets its name only when it is complete.
class ArchiveInTheMaking {
 public:
  explicit ArchiveInTheMaking(const fs::path& to)
      : to_(to), made_(fmt::format("{}.new-{}", to.string(), getpid())) {
    if (fs::exists(to)) {
      throw std::runtime_error(
          fmt::format("{}: exists; give another name, nothing is overwritten", to.string()));
    }
    RequireOutsideSites(to);
  }
  ~ArchiveInTheMaking() {
    std::error_code ignored;
    fs::remove(made_, ignored);
  }
  const fs::path& path() const { return made_; }
  void Commit() {
    fs::rename(made_, to_);
    SyncToDisk(fs::absolute(to_).parent_path());
  }

 private:
  const fs::path to_, made_;
};

int64_t WriteArchive(const std::vector<Source>& sources, const fs::path& to) {
  ArchiveInTheMaking made(to);
  ArchiveFileWriter writer(made.path());
  const int64_t utime = std::chrono::duration_cast<std::chrono::microseconds>(
                            std::chrono::system_clock::now().time_since_epoch())
                            .count();
  const Checksums read =
      CopyFiles(sources, {[&](const Source& source) {
                            writer.Begin(kTop + source.name, source.bytes, source.mode, utime);
                          },
                          [&](Bytes part) { writer.Write(part); }});
  writer.Finish();
  CheckWritten(read, ReadArchive(made.path(), {[](const Source&) {}, [](Bytes) {}}), to);
  made.Commit();
  return static_cast<int64_t>(fs::file_size(to));
}

int64_t WriteFolder(std::vector<Source> sources, const Site& site, const fs::path& to) {
  SiteInTheMaking made(to);
  const Checksums read = CopyToFolder(sources, made.folder());
  int64_t bytes = 0;
  for (Source& source : sources) {
    source.path = made.folder() / source.name;
    bytes += source.bytes;
  }
  CheckWritten(read, CopyFiles(sources, {[](const Source&) {}, [](Bytes) {}}), to);
  made.Commit(site.description);
  return bytes;
}

}  // namespace

BackupSummary BackUp(const Site& site, const fs::path& to, bool with_keys) {
  const std::set<std::string> archives{".zip", ".tar", ".gz", ".tgz", ".zst", ".xz", ".7z"};
  if (!IsArchive(to) && archives.contains(to.extension())) {
    throw std::runtime_error(
        fmt::format("{}: is no name for a folder; an archive is NAME{}", to.string(), kArchiveEnd));
  }
  const WholePart journal = FindWholePart(site);
  const std::vector<Source> sources = SourcesOf(site, with_keys, journal);
  BackupSummary summary{journal.bytes, journal.events,
                        journal.lost_bytes + LostBehind(journal, site), 0};
  summary.bytes = IsArchive(to) ? WriteArchive(sources, to) : WriteFolder(sources, site, to);
  return summary;
}

BackupSummary Restore(const fs::path& from, const fs::path& folder) {
  SiteInTheMaking made(folder);
  int64_t lost_bytes = 0;
  if (fs::is_directory(from)) {
    const Site site = ReadSite(from);
    const WholePart journal = FindWholePart(site);
    lost_bytes = LostBehind(journal, site);
    CopyToFolder(SourcesOf(site, true, journal), made.folder());
  } else {
    std::unique_ptr<NewFile> file;
    ReadArchive(from, {[&](const Source& source) {
                         file = std::make_unique<NewFile>(MakeRoomFor(made.folder(), source.name),
                                                          source.mode);
                       },
                       [&](Bytes part) { file->Write(part); }});
  }
  const Site restored = ReadSite(made.folder());
  const WholePart journal = FindWholePart(restored);
  made.Commit(restored.description);
  return {journal.bytes, journal.events, journal.lost_bytes + lost_bytes, journal.bytes};
}

}  // namespace pangea::site
