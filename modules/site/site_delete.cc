#include "site/site_delete.h"

#include <fmt/format.h>

#include <stdexcept>

#include "files/disk_io.h"
#include "files/make_folder.h"

namespace pangea::site {

namespace fs = std::filesystem;

namespace {

// Appends "-2", "-3", ... if the name exists already.
fs::path NameFor(const fs::path& folder) {
  const std::string first = folder.string() + kDeletedMark + TimeForFileName();
  std::string name = first;
  for (int i = 2; fs::exists(name); ++i) {
    name = fmt::format("{}-{}", first, i);
  }
  return name;
}

}  // namespace

fs::path Delete(const Site& site, bool now) {
  const SiteLock lock(site);
  const fs::path folder = WithoutSlash(fs::absolute(site.folder));
  if (const std::string foreign = ForeignFile(folder); now && !foreign.empty()) {
    throw std::runtime_error(fmt::format(
        "{}: '{}' in it is nothing of a site's: move that away, or delete without --now",
        site.folder.string(), foreign));
  }
  fs::path away = NameFor(folder);
  fs::rename(folder, away);
  SyncToDisk(folder.parent_path());
  if (!now) {
    return away;
  }
  fs::remove_all(away);
  return {};
}

}  // namespace pangea::site
