#include "site/site_files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <iterator>
#include <stdexcept>

#include "files/progress.h"
#include "log_file/checked_scan.h"
#include "messages/channels.h"

namespace pangea::site {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> FilesIn(const fs::path& folder, const std::string& extension) {
  std::vector<fs::path> files;
  if (fs::is_directory(folder)) {
    for (const auto& entry : fs::directory_iterator(folder)) {
      if (entry.is_regular_file() && entry.path().extension() == extension) {
        files.push_back(entry.path());
      }
    }
  }
  std::ranges::sort(files);
  return files;
}

class OpenedFile {
 public:
  explicit OpenedFile(const fs::path& path) : fd_(open(path.c_str(), O_RDONLY | O_CLOEXEC)) {
    if (fd_ < 0) {
      throw std::runtime_error(
          fmt::format("{}: cannot be opened: {}", path.string(), std::strerror(errno)));
    }
  }
  ~OpenedFile() { close(fd_); }
  OpenedFile(const OpenedFile&) = delete;
  OpenedFile& operator=(const OpenedFile&) = delete;
  int fd() const { return fd_; }

 private:
  const int fd_;
};

bool IsPlainName(const std::string& name) {
  return !name.empty() && name.front() != '.' && std::ranges::all_of(name, [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_' || c == '-' || c == '.';
  });
}

}  // namespace

std::vector<fs::path> KeyFiles(const Site& site) { return FilesIn(site.keys(), ".key"); }
std::vector<fs::path> OptionFiles(const Site& site) { return FilesIn(site.options(), ".yaml"); }

std::vector<fs::path> GatewayAgentFiles(const Site& site) {
  return FilesIn(site.gateway() / "agents", ".json");
}
std::vector<fs::path> GatewayIdentityFiles(const Site& site) {
  std::vector<fs::path> files = FilesIn(site.gateway(), ".key");
  std::ranges::copy(FilesIn(site.gateway(), ".pem"), std::back_inserter(files));
  return files;
}

bool IsFileOfSite(const std::string& name) {
  const auto is_in = [&name](const std::string& folder, const std::string& extension) {
    return name.starts_with(folder) && name.ends_with(extension) &&
           IsPlainName(name.substr(folder.size()));
  };
  return name == "site.yaml" || name == "tags.yaml" || name == "journal.lcm" ||
         is_in("keys/", ".key") || is_in("options/", ".yaml") ||
         is_in("gateway/agents/", ".json") || is_in("gateway/", ".key") ||
         is_in("gateway/", ".pem");
}

WholePart FindWholePart(const Site& site) {
  constexpr int64_t kMegabyte = 1'000'000;
  const fs::path journal = site.journal();
  if (!fs::exists(journal)) {
    return {};
  }
  const bool is_written = UserOf(site).has_value();
  const OpenedFile file(journal);
  CheckedScan scan(file.fd());
  Progress progress("checking " + journal.string());
  WholePart read, checked;
  int64_t lost_bytes = 0;
  bool has_checksums = false;
  while (const CheckedScan::Piece* piece = scan.Next()) {
    if (piece->kind == LogPiece::Kind::kTornTail) {
      break;
    }
    progress.Update(piece->end() / kMegabyte, scan.file_bytes() / kMegabyte, "MB");
    const bool whole = piece->kind == LogPiece::Kind::kEvent && !FillsDamage(*piece);
    read.events += whole ? 1 : 0;
    lost_bytes += whole ? 0 : piece->bytes;
    read.lost_bytes = whole ? lost_bytes : read.lost_bytes;
    read.bytes = whole ? piece->end() : read.bytes;
    if (whole && ChecksumsOf(piece->whole)) {
      has_checksums = true;
      checked = read;
    }
  }
  return is_written && has_checksums ? checked : read;
}

}  // namespace pangea::site
