#include "site/site.h"

#include <fcntl.h>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <stdexcept>

#include "bus/bus.h"
#include "bus/bus_url.h"
#include "files/disk_io.h"
#include "files/make_folder.h"
#include "files/text_file.h"
#include "link/wire.h"
#include "options/yaml_options.h"

namespace pangea::site {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFolders[] = {"keys", "options", "logs"};
constexpr size_t kMaxName = 100;

// Whether a name is one of a site's files: a folder that becomes a site may have no others.
bool IsOurs(const std::string& name) {
  return std::ranges::find(kFolders, name) != std::end(kFolders) || name == "lock" ||
         name == "checkpoint" || name == "gateway" || name == "recordings" || name == "site.yaml" ||
         name == "tags.yaml" || name == "site.yaml.new" || name.starts_with("journal.lcm");
}

void CheckDescription(const fs::path& file, const SiteDescription& description) {
  const auto refuse = [&](const std::string& what) {
    throw std::runtime_error(fmt::format("{}: {}", file.string(), what));
  };
  if (description.format != SiteDescription::kFormat) {
    refuse(fmt::format("format: {}; this version reads {}: use the version that wrote it",
                       description.format, SiteDescription::kFormat));
  }
  const std::string& name = description.name;
  if (name.empty() || name.size() > kMaxName ||
      std::ranges::any_of(name, [](unsigned char c) { return c < 0x20 || c == 0x7f; })) {
    refuse(fmt::format("name: give 1 to {} printable bytes", kMaxName));
  }
  if (description.bus.empty() || description.link.empty() ||
      IsOneBus(description.bus, description.link)) {
    refuse("bus, link: give two LCM URLs that differ before the '?'");
  }
  for (const auto& [key, url] : {std::pair("bus", description.bus), {"link", description.link}}) {
    if (const std::string why = WhyNoBus(url); !why.empty()) {
      refuse(fmt::format("{}: {}", key, why));
    }
  }
}

void CheckCanBecomeSite(const fs::path& folder) {
  if (fs::exists(folder) && !fs::is_directory(folder)) {
    throw std::runtime_error(
        fmt::format("{}: is no folder; a site is one: give another name", folder.string()));
  }
  if (!fs::exists(folder)) {
    return;
  }
  if (const std::string foreign = ForeignFile(folder); !foreign.empty()) {
    throw std::runtime_error(
        fmt::format("{}: is a folder without site.yaml, and '{}' in it is nothing of a site's; "
                    "name a new folder, or an empty one",
                    folder.string(), foreign));
  }
}

// Creates the site's folders, and then site.yaml, which makes it a site.
void WriteSite(const Site& site) {
  CheckDescription(site.file(), site.description);
  for (const char* name : kFolders) {
    fs::create_directories(site.folder / name);
  }
  for (const fs::path& secret : {site.keys(), site.gateway()}) {
    if (fs::exists(secret)) {
      fs::permissions(secret, fs::perms::owner_all);
    }
  }
  SiteDescription description = site.description;
  YamlOptions yaml;
  description.Visit(yaml);
  const fs::path made = site.folder / "site.yaml.new";
  WriteTextFile(made, yaml.PrintWithoutHelp());
  SyncToDisk(made);
  fs::rename(made, site.file());
  SyncToDisk(site.folder);
}

// Gives the file to the folder's owner: root may manage a site that the server's user owns.
void GiveToOwnerOf(const fs::path& folder, int fd) {
  struct stat info {};
  if (geteuid() == 0 && stat(folder.c_str(), &info) == 0) {
    // A failure shows when the owner opens the file.
    [[maybe_unused]] const int ignored = fchown(fd, info.st_uid, info.st_gid);
  }
}

fs::path Absolute(const fs::path& folder) {
  if (folder.empty()) {
    throw std::runtime_error("the folder's name is empty: give one");
  }
  return WithoutSlash(fs::absolute(folder));
}

fs::path LockOf(const Site& site) { return site.folder / "lock"; }

// A lock of the whole file, held by the open file description: unlike one by flock, it can be
// queried without taking it.
struct flock WholeFile(short type) {
  struct flock lock {};
  lock.l_type = type;
  lock.l_whence = SEEK_SET;
  return lock;
}

// 0 if unknown.
int ReadPid(int fd) {
  char text[20] = {};
  return pread(fd, text, sizeof(text) - 1, 0) > 0 ? std::atoi(text) : 0;
}

}  // namespace

std::string InShell(const fs::path& path) {
  std::string text = path;
  if (!text.empty() && std::ranges::all_of(text, [](unsigned char c) {
        return c > 0x7f || std::isalnum(c) != 0 || std::strchr("_-./+,:@%=", c) != nullptr;
      })) {
    return text;
  }
  for (size_t at = 0; (at = text.find('\'', at)) != std::string::npos; at += 4) {
    text.replace(at, 1, "'\\''");
  }
  return "'" + text + "'";
}

std::string NameOfFolder(const fs::path& folder) { return Absolute(folder).filename(); }

SiteDescription NewDescription(const std::string& name) {
  SiteDescription description;
  description.name = name;
  description.created = fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)));
  description.bus = kDefaultBusUrl;
  description.link = kDefaultLinkUrl;
  return description;
}

std::string ForeignFile(const fs::path& folder) {
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (std::string name = entry.path().filename(); !IsOurs(name)) {
      return name;
    }
  }
  return "";
}

std::vector<fs::path> SitesInside(const Site& site) {
  std::vector<fs::path> inside;
  std::error_code error;  // a running server may remove a folder meanwhile
  fs::recursive_directory_iterator at(site.folder, fs::directory_options::skip_permission_denied,
                                      error);
  for (; at != fs::recursive_directory_iterator(); at.increment(error)) {
    if (at->path().filename() == "site.yaml" && at->path() != site.file()) {
      inside.push_back(at->path().parent_path());
    }
  }
  return inside;
}

void RequireOutsideSites(const fs::path& path) {
  for (fs::path at = fs::weakly_canonical(Absolute(path)); at.has_relative_path();) {
    at = at.parent_path();
    std::error_code ignored;
    if (fs::exists(at / "site.yaml", ignored)) {
      throw std::runtime_error(
          fmt::format("{}: is inside the site {}, and would be deleted with it; give another place",
                      path.string(), at.string()));
    }
  }
}

Site ReadSite(const fs::path& folder) {
  Site site{folder, {}};
  if (fs::exists(folder) && !fs::is_directory(folder)) {
    throw std::runtime_error(fmt::format("{}: is no folder; a site is one", folder.string()));
  }
  if (!fs::exists(site.file())) {
    throw std::runtime_error(
        fmt::format("{}: is no site: it has no site.yaml; pangea-site create {} makes one",
                    folder.string(), InShell(folder)));
  }
  YamlOptions yaml;
  site.description.Visit(yaml);
  for (const std::string& key : yaml.Keys()) {
    yaml.Require(key);
  }
  yaml.ReadFile(site.file());
  CheckDescription(site.file(), site.description);
  return site;
}

Site CreateSite(const fs::path& folder, const SiteDescription& description) {
  Site site{folder, description};
  CheckDescription(site.file(), description);
  if (fs::exists(site.file())) {
    throw std::runtime_error(
        fmt::format("{}: is a site already; give another folder", folder.string()));
  }
  CheckCanBecomeSite(folder);
  RequireOutsideSites(folder);
  fs::create_directories(folder);
  WriteSite(site);
  return site;
}

Site OpenSite(const fs::path& folder) {
  if (fs::exists(folder / "site.yaml")) {
    return ReadSite(folder);
  }
  return CreateSite(folder, NewDescription(NameOfFolder(folder)));
}

SiteInTheMaking::SiteInTheMaking(const fs::path& folder)
    : target_(Absolute(folder)), staging_(fmt::format("{}.new-{}", target_.string(), getpid())) {
  if (fs::exists(target_) && !(fs::is_directory(target_) && fs::is_empty(target_))) {
    throw std::runtime_error(
        fmt::format("{}: exists; give another name, nothing is overwritten", target_.string()));
  }
  RequireOutsideSites(target_);
  fs::create_directories(staging_);
}

SiteInTheMaking::~SiteInTheMaking() {
  std::error_code ignored;
  fs::remove_all(staging_, ignored);
}

void SiteInTheMaking::Commit(const SiteDescription& description) {
  WriteSite({staging_, description});
  for (const auto& entry : fs::recursive_directory_iterator(staging_)) {
    SyncToDisk(entry.path());
  }
  fs::rename(staging_, target_);
  SyncToDisk(target_.parent_path());
}

SiteLock::SiteLock(const Site& site) {
  const std::string path = LockOf(site);
  fd_ = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (fd_ < 0) {
    throw std::runtime_error(fmt::format("{}: cannot be opened: {}; run as the site's owner", path,
                                         std::strerror(errno)));
  }
  struct flock lock = WholeFile(F_WRLCK);
  if (fcntl(fd_, F_OFD_SETLK, &lock) != 0) {
    const int pid = ReadPid(fd_);
    close(fd_);
    throw std::runtime_error(
        fmt::format("{}: is in use by process {}; end that first", site.folder.string(), pid));
  }
  GiveToOwnerOf(site.folder, fd_);
  const std::string text = fmt::format("{}\n", getpid());
  if (ftruncate(fd_, 0) != 0 ||
      pwrite(fd_, text.data(), text.size(), 0) != static_cast<ssize_t>(text.size())) {
    const int error = errno;
    close(fd_);
    throw std::runtime_error(fmt::format("{}: cannot be written: {}", path, std::strerror(error)));
  }
}

SiteLock::~SiteLock() { close(fd_); }

std::optional<int> UserOf(const Site& site) {
  const int fd = open(LockOf(site).c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) {
    return std::nullopt;
  }
  struct flock lock = WholeFile(F_RDLCK);
  std::optional<int> user;
  if (fcntl(fd, F_OFD_GETLK, &lock) == 0 && lock.l_type != F_UNLCK) {
    user = ReadPid(fd);
  }
  close(fd);
  return user;
}

std::string TimeForFileName() {
  return fmt::format("{:%Y%m%dT%H%M%SZ}", fmt::gmtime(std::time(nullptr)));
}

}  // namespace pangea::site
