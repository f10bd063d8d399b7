#pragma once

// The options of all server processes that compute, by process: as one file, as the log of a live
// server has them (OPTIONS_*), as single values.
//
//   fusion:
//     alignment: {min_inliers: 20}
//   posegraph:
//     scope: paper

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "anchors/anchors.h"
#include "fusion/fusion.h"
#include "global_ba/global_ba.h"
#include "inter_map_ba/inter_map_ba.h"
#include "log_file/log_reading.h"
#include "place_recognition/place_recognition.h"
#include "posegraph/posegraph.h"

namespace pangea {

struct ServerOptions {
  PlaceRecognitionOptions place_recognition;
  InterMapBaOptions inter_map_ba;
  FusionOptions fusion;
  PoseGraphOptions posegraph;
  GlobalBaOptions global_ba;
  AnchorsOptions anchors;

  // A section for each process, by its name on the bus.
  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Section("place_recognition", &place_recognition, "");
    archive.Section("inter_map_ba", &inter_map_ba, "");
    archive.Section("fusion", &fusion, "");
    archive.Section("posegraph", &posegraph, "");
    archive.Section("global_ba", &global_ba, "");
    archive.Section("anchors", &anchors, "");
  }
};

struct LoggedOptions {
  ServerOptions options;
  std::vector<std::string> notes;  // for people: which are defaults, and why
};

// The newest of each process in the logs, a later log before an earlier one. What this version
// does not know is left out, and what it cannot read leaves that process' defaults; each with a
// note. What is lost of a log is noted in `readings` (log_reader.h).
LoggedOptions ReadLoggedOptions(const std::vector<std::filesystem::path>& logs,
                                LogReadings* readings = nullptr);

// Over `options`: the file, if there is one, then each "process.key=value". Throws
// std::runtime_error.
void Override(const std::string& file, const std::vector<std::string>& values,
              ServerOptions* options);

// As each process tells them: its name, and what its --options takes.
std::map<std::string, std::string> TextsByProcess(ServerOptions options);

// "fusion.alignment.min_inliers 20 (default 16)", one for each value that is not the default.
std::vector<std::string> OtherThanDefault(ServerOptions options);

}  // namespace pangea
