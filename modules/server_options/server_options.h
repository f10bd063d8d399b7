#pragma once

// The options of all server processes with options, one section per process. They come from a file,
// from the log of a live server (OPTIONS_*), or as single values.
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
#include "global_ba/global_ba.h"
#include "log_file/log_reading.h"
#include "loop_verification/loop_verifier.h"
#include "place_recognition/place_recognition.h"
#include "posegraph/posegraph.h"

namespace pangea {

struct ServerOptions {
  PlaceRecognitionOptions place_recognition;
  LoopVerifierOptions inter_map_ba;
  LoopVerifierOptions fusion;
  PoseGraphOptions posegraph;
  GlobalBaOptions global_ba;
  AnchorsOptions anchors;

  // One section per process, with its name on the bus.
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
  std::vector<std::string> notes;  // for people: which sections are defaults, and why
};

// Reads the newest options of each process in the logs; a later log in the list takes precedence.
// Unknown options are skipped, and a process whose options cannot be read has defaults; each case
// adds a note. Damaged parts of a log are reported in `readings` (log_reader.h).
LoggedOptions ReadLoggedOptions(const std::vector<std::filesystem::path>& logs,
                                LogReadings* readings = nullptr);

// Applies to `options`: first the file (if `file` is not empty), then each "process.key=value".
// Throws std::runtime_error for an error in either.
void Override(const std::string& file, const std::vector<std::string>& values,
              ServerOptions* options);

// By process name: the text that its --options takes, as published on OPTIONS_*.
std::map<std::string, std::string> TextsByProcess(ServerOptions options);

// "fusion.alignment.min_inliers 20 (default 16)", one line per value that is not the default.
std::vector<std::string> OtherThanDefault(ServerOptions options);

}  // namespace pangea
