#include "report/earlier_report.h"

#include <fmt/format.h>

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <vector>

#include "core/ids.h"
#include "files/text_file.h"
#include "report/report_anchor_pictures.h"
#include "report/report_text.h"

namespace pangea {
namespace {

using nlohmann::json;

// "1/1700000000000000", as report.json has it. Throws if it is anything else: it becomes a file
// name.
MapId MapOf(const std::string& text) {
  const size_t slash = text.find('/');
  const MapId map{std::stoi(text), std::stoll(text.substr(slash + 1))};
  if (ToString(map) != text) {
    throw std::runtime_error("no map");
  }
  return map;
}

// The names of report.h. A map has fewer of these files.
std::vector<std::string> FilesOf(const json& report) {
  std::vector<std::string> files{"map.ply", "trajectory.png", "error.png", kAnchorPicture};
  for (const json& agent : report.at("agents")) {
    const std::string prefix = fmt::format("agent_{}", agent.at("id").get<int32_t>());
    files.insert(files.end(), {prefix + ".tum", prefix + ".vio.tum"});
    for (const json& id : agent.at("map_ids")) {
      const std::string map = FileName(MapOf(id.get<std::string>()));
      files.push_back(fmt::format("{}.{}.tum", prefix, map));
      files.push_back(fmt::format("{}.{}.vio.tum", prefix, map));
      files.push_back(fmt::format("map.{}.ply", map));
      files.push_back(fmt::format("trajectory.{}.png", map));
    }
  }
  return files;
}

}  // namespace

void RemoveEarlierReport(const std::string& folder) {
  std::vector<std::string> files;
  try {
    files = FilesOf(json::parse(ReadTextFile(folder + "/report.json")));
  } catch (const std::exception&) {
    return;  // there is none, or it is another program's
  }
  for (const std::string& file : files) {
    std::error_code error;  // what cannot be removed cannot be replaced either, which is said then
    std::filesystem::remove(folder + "/" + file, error);
  }
}

}  // namespace pangea
