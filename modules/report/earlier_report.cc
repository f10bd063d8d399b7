#include "report/earlier_report.h"

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <vector>

#include "core/ids.h"
#include "files/text_file.h"
#include "report/report_files.h"

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

// A map has fewer of these files.
std::vector<std::string> FilesOf(const json& report) {
  std::vector<std::string> files{PlyFile(), TrajectoryPicture(), kErrorPicture, kAnchorPicture};
  for (const json& agent : report.at("agents")) {
    const auto id = agent.at("id").get<int32_t>();
    files.insert(files.end(), {TrajectoryFile(id), OdometryFile(id)});
    for (const json& map_id : agent.at("map_ids")) {
      const MapId map = MapOf(map_id.get<std::string>());
      files.insert(files.end(), {TrajectoryFile(id, map), OdometryFile(id, map), PlyFile(map),
                                 TrajectoryPicture(map)});
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
