#include "site/site_export.h"

#include <fmt/format.h>

#include <algorithm>
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

constexpr const char* kPartial = "export.partial";

bool HasOnlyPartial(const fs::path& folder) {
  const auto entries = fs::directory_iterator(folder);
  return std::all_of(begin(entries), end(entries), [](const fs::directory_entry& entry) {
    return entry.path().filename() == kPartial;
  });
}

// The files are made in a folder inside the new one, and moved up when all of them are complete. So
// a failed export is removed, and one that was killed is known by its name, and not in the way.
class NewFolder {
 public:
  explicit NewFolder(const fs::path& path) : path_(path), is_new_(!fs::exists(path)) {
    if (!is_new_ && !(fs::is_directory(path) && HasOnlyPartial(path))) {
      throw std::runtime_error(fmt::format(
          "--out {}: exists; give a new folder, nothing is overwritten", path.string()));
    }
    RequireOutsideSites(path);
    fs::remove_all(partial());
    fs::create_directories(partial());
  }
  ~NewFolder() {
    std::error_code ignored;
    fs::remove_all(partial(), ignored);
    if (is_new_) {
      fs::remove(path_, ignored);  // if it is empty
    }
  }
  NewFolder(const NewFolder&) = delete;
  NewFolder& operator=(const NewFolder&) = delete;

  fs::path partial() const { return path_ / kPartial; }
  // Returns where the files are then.
  std::vector<std::string> Keep(const std::vector<fs::path>& files) const {
    std::vector<std::string> kept;
    for (const fs::path& file : files) {
      kept.push_back(path_ / file.filename());
      fs::rename(file, kept.back());
    }
    return kept;
  }

 private:
  const fs::path path_;
  const bool is_new_;
};

}  // namespace

std::vector<std::string> ExportSite(const Site& site, const fs::path& out, LogReadings* readings) {
  if (!fs::exists(site.journal())) {
    throw std::runtime_error(
        fmt::format("{}: there is no journal yet, nothing to export", site.journal().string()));
  }
  const NewFolder folder(out);
  const fs::path replayed = folder.partial() / "replay.lcm";
  const LoggedOptions logged = ReadLoggedOptions({site.journal()}, readings);
  {
    Progress progress("pangea-site");
    Replay({site.journal()}, logged.options, std::numeric_limits<double>::infinity(), replayed,
           progress, readings);
  }
  const std::vector<std::string> trajectories = ExportTum(replayed, folder.partial());
  std::vector<fs::path> files(trajectories.begin(), trajectories.end());
  files.push_back(folder.partial() / "map.ply");
  ExportPly(replayed, files.back());
  const LoggedAnchors anchors = ReadAnchors(replayed);
  if (!anchors.anchors.empty()) {
    files.push_back(folder.partial() / "anchors.json");
    WriteTextFile(files.back(), ToJson(anchors));
    files.push_back(folder.partial() / "map.gltf");
    ExportGltf(replayed, anchors, files.back());
  }
  return folder.Keep(files);
}

}  // namespace pangea::site
