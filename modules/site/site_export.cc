#include "site/site_export.h"

#include <fmt/format.h>

#include <limits>
#include <stdexcept>

#include "files/progress.h"
#include "files/text_file.h"
#include "log_tools/anchors_gltf.h"
#include "log_tools/log_anchors.h"
#include "log_tools/log_export.h"
#include "replay/replay.h"
#include "server_options/server_options.h"

namespace pangea::site {

namespace fs = std::filesystem;

namespace {

// A failed export is removed: it would be in the way of the next one.
class NewFolder {
 public:
  explicit NewFolder(const fs::path& path) : path_(path) { fs::create_directories(path); }
  ~NewFolder() {
    if (!is_complete_) {
      std::error_code ignored;
      fs::remove_all(path_, ignored);
    }
  }
  NewFolder(const NewFolder&) = delete;
  NewFolder& operator=(const NewFolder&) = delete;
  void Keep() { is_complete_ = true; }

 private:
  const fs::path path_;
  bool is_complete_ = false;
};

}  // namespace

std::vector<std::string> ExportSite(const Site& site, const fs::path& out, LogReadings* readings) {
  if (!fs::exists(site.journal())) {
    throw std::runtime_error(
        fmt::format("{}: there is no journal yet, nothing to export", site.journal().string()));
  }
  if (fs::exists(out) && !(fs::is_directory(out) && fs::is_empty(out))) {
    throw std::runtime_error(
        fmt::format("--out {}: exists; give a new folder, nothing is overwritten", out.string()));
  }
  RequireOutsideSites(out);
  NewFolder folder(out);
  const fs::path replayed = out / "replay.lcm";
  const LoggedOptions logged = ReadLoggedOptions({site.journal()}, readings);
  {
    Progress progress("pangea-site");
    Replay({site.journal()}, logged.options, std::numeric_limits<double>::infinity(), replayed,
           progress, readings);
  }
  std::vector<std::string> files = ExportTum(replayed, out);
  files.push_back(out / "map.ply");
  ExportPly(replayed, files.back());
  const LoggedAnchors anchors = ReadAnchors(replayed, nullptr, logged.options.anchors.max_anchors);
  if (!anchors.anchors.empty()) {
    files.push_back(out / "anchors.json");
    WriteTextFile(files.back(), ToJson(anchors));
    files.push_back(out / "map.gltf");
    ExportGltf(replayed, anchors, files.back());
  }
  fs::remove(replayed);
  folder.Keep();
  return files;
}

}  // namespace pangea::site
