#include "site/site_delete.h"

#include <fmt/format.h>

namespace pangea::site {

namespace fs = std::filesystem;

fs::path Delete(const Site& site, bool now) {
  const SiteLock lock(site);
  const fs::path folder = fs::absolute(site.folder / "").parent_path();
  const fs::path away = fmt::format("{}.deleted-{}", folder.string(), TimeForFileName());
  fs::rename(folder, away);
  SyncToDisk(folder.parent_path());
  if (!now) {
    return away;
  }
  fs::remove_all(away);
  return {};
}

}  // namespace pangea::site
