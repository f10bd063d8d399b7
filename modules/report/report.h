#pragma once

// Makes the output directory from captured logs: trajectories, map, metrics, pictures. The same
// after a live run and after a replay; the same input gives the same bytes.
//
// Writes into `folder` (which must exist), in place of an earlier report's files:
//   agent_<id>.vio.tum       T_odom_body of the agent's main map, raw odometry at camera rate
//                            (of its other maps: agent_<id>.<map>.vio.tum)
//   agent_<id>.tum           T_map_body of the keyframes of its recording, in the map frame of its
//                            main group: the group that has most of them
//                            (every map that is not alone in it: agent_<id>.<map>.tum)
//   map.ply                  points coloured by agent, in the largest group's map frame (other
//                            groups, whose frames are unrelated to it: map.<map>.ply)
//   report.json, report.md, report.html
//   anchors.jpg              up to four anchors in the images of two agents, if the recordings
//                            are at hand
//   trajectory.png, error.png
//                            (groups that no ground truth places: trajectory.<map>.png)
//
// A map that no MAP_STATE mentions is a group of its own, with the odometry's poses. <map> is
// "<agent>_<opened utime>".

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/ids.h"
#include "log_file/log_reading.h"
#include "report/expectations.h"

namespace pangea {

// An emulated bad link between an agent and the server.
struct LinkRun {
  std::string conditions;                     // for people: "loss 5 %, delay 50 ms"
  std::map<std::string, int64_t> packets_up;  // by outcome: "taken", "delivered", ...
  std::map<std::string, int64_t> packets_down;
};

struct AgentRun {
  int32_t id = 0;
  // EuRoC folder with ground truth; without it there is no ATE
  std::string recording;
  // the part of the recording that was played, seconds since its first image
  double start_s = 0;
  std::optional<double> duration_s;  // empty: to its end
  // the maps made from it; empty: unknown. A continued journal has maps of earlier recordings too
  std::optional<std::set<MapId>> maps;
  // log of the agent's bus with POSE_<id> and anchors; without it, the odometry's trajectory is
  // that of its keyframes
  std::string bus_log;
  // payload on the link bus; empty if not measured (a replay)
  std::optional<int64_t> bytes_up;
  std::optional<int64_t> bytes_down;
  std::optional<LinkRun> link;
  // recording time played / wall time
  std::optional<double> realtime_factor;
};

// An anchor that the session should place; it is reported even if it is not in the logs.
struct WantedAnchor {
  int32_t agent = 0;
  std::string name;
};

struct ReportInput {
  // log of the server bus: KEYFRAME_*, CONSTRAINT, MAP_STATE, ANCHOR_EDIT, STATUS_*
  std::string server_log = {};
  // may lack agents of the log
  std::vector<AgentRun> agents = {};
  // of the other processes, by name: measured recording time / CPU or wall time
  std::map<std::string, double> realtime_factors = {};
  // number of restarts by process name; only processes that were restarted
  std::map<std::string, int> restarts = {};
  // further notes for the reader, e.g. warnings about a recording
  std::vector<std::string> notes = {};
  std::vector<WantedAnchor> anchors = {};
  // bounds on the metrics, checked at the end of the report
  Expectations expect = {};
};

struct WrittenReport {
  std::string text;                         // of report.md
  std::vector<AgentRun> runs;               // of the input, with their maps where these are known
  std::vector<CheckedExpectation> checked;  // one per expectation of the input
};

// Throws std::runtime_error if the server log cannot be read or the folder cannot be written; a
// picture that cannot be drawn becomes a note in the report. For a damaged log, the metrics use its
// readable parts, and the report says so at its top. The damage is added to `readings`
// (log_reader.h); the report also states the damage that `readings` contains already, of the logs
// from which this one was made.
WrittenReport WriteReport(const ReportInput& input, const std::string& folder,
                          LogReadings* readings = nullptr);

}  // namespace pangea
