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

std::vector<std::string> ExportSite(const Site& site, const fs::path& out, LogReadings* readings) {
  if (!fs::exists(site.journal())) {
    throw std::runtime_error(
        fmt::format("{}: there is no journal yet, nothing to export", site.journal().string()));
  }
  if (fs::exists(out) && !(fs::is_directory(out) && fs::is_empty(out))) {
    throw std::runtime_error(
        fmt::format("--out {}: exists; give a new folder, nothing is overwritten", out.string()));
  }
  fs::create_directories(out);
  const fs::path replayed = out / "replay.lcm";
  const LoggedOptions logged = ReadLoggedOptions({site.journal()}, readings);
  {
    Progress progress("pangea-site");
    session::Replay({site.journal()}, logged.options, std::numeric_limits<double>::infinity(),
                    replayed, progress, readings);
  }
  std::vector<std::string> files = session::ExportTum(replayed, out);
  files.push_back(out / "map.ply");
  session::ExportPly(replayed, files.back());
  const session::LoggedAnchors anchors = session::ReadAnchors(replayed);
  if (!anchors.anchors.empty()) {
    files.push_back(out / "anchors.json");
    WriteTextFile(files.back(), session::ToJson(anchors));
    files.push_back(out / "map.gltf");
    session::ExportGltf(replayed, anchors, files.back());
  }
  fs::remove(replayed);
  return files;
}

}  // namespace pangea::site
