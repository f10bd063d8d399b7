#pragma once

// A scripted session: which agents play which recordings, and when.
//
//   agents:
//     - {id: 1, recording: ../recordings/MH_01}
//     - {id: 2, recording: ../recordings/MH_02, delay: 5, start: 10, duration: 60}
//     - {id: 3, recording: ../recordings/MH_03, keyframes: MH_03/keyframes.lcm,
//        link: {loss: 0.05, delay_ms: 50, partitions: [{at: 30, seconds: 60}]}}
//     - {id: 4, live: true, duration: 300}
//   faults:                                             # faults.h
//     - {at: 12.5, kill: fusion}
//     - {at: 20, disconnect: 2, seconds: 10}
//   anchors:                                            # anchor_placer.h
//     - {agent: 1, at: 12, name: kettle, pixel: [376, 240]}
//   options:                                            # server_options.h
//     fusion: {alignment: {min_inliers: 20}}
//   expect: {fused_by: 40, ate_joint_m: 0.1}            # expectations.h

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "agent_handler/agent_handler_options.h"
#include "link_emulator/link_conditions.h"
#include "report/expectations.h"
#include "server_options/server_options.h"
#include "session/run/faults.h"
#include "uplink/uplink.h"
#include "vio/vio_file_options.h"

namespace pangea::session {

// Tested on one machine: each agent is three processes and an LCM bus.
inline constexpr size_t kMaxSessionAgents = 200;

inline constexpr size_t kMaxScriptedAnchors = 1000;

struct AgentScript {
  int32_t id = 0;  // 1 .. 65535, unique in the session
  // Folder, relative to the session file or to --recordings; may be missing if there are keyframes
  // or live sensors.
  std::string recording;
  // The agent's sensors publish on its bus, and no recording is played; a given recording only
  // provides ground truth. Ends after `duration_s`, or with the session.
  bool live = false;
  double delay_s = 0;     // session time at which the agent starts
  double start_s = 0;     // where in the recording it starts
  double duration_s = 0;  // how much of it is played; 0 = to the end
  // An LCM log with the agent's keyframes (and possibly others'). They are played instead of
  // running the odometry; the recording then only provides ground truth. Relative to the session
  // file; empty for none.
  std::string keyframes;
  std::optional<LinkConditions> link;              // emulated bad link to the server
  std::optional<vio::VioFileOptions> vio_options;  // odometry options; empty: defaults
  UplinkOptions uplink;
  std::filesystem::path resolved;  // the recording's folder as found; empty without a recording
  std::filesystem::path resolved_keyframes;
};

// An anchor that an agent places: on the surface at `pixel` in its image nearest to `at_s`.
struct AnchorScript {
  int32_t agent = 0;  // must have a recording
  double at_s = 0;    // since the recording's first image, like AgentScript::start_s
  std::string name;   // unique in the session
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  // raw: x, y
  std::string payload;
};

// Options of the server's processes, including agent_handler, which keeps the journal.
struct SessionServerOptions : ServerOptions {
  AgentHandlerOptions agent_handler;

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Section("agent_handler", &agent_handler, "");
    ServerOptions::Visit(archive);
  }
};

struct SessionScript {
  std::vector<AgentScript> agents;
  std::vector<Fault> faults;
  std::vector<AnchorScript> anchors;
  SessionServerOptions options;
  Expectations expect;
};

// Reads and checks a session file, but not the recordings and logs it names. Throws
// std::runtime_error with file, key and correction.
SessionScript ParseSessionFile(const std::filesystem::path& file);

// Finds the recordings and keyframe logs of a session. Recordings are relative to `recordings` if
// given, else to the session file's folder; MH_01 also finds MH_01_easy. Returns one line for each
// missing input: "agent 2: /data/MH_09".
std::vector<std::string> FindInputs(const std::filesystem::path& file,
                                    const std::optional<std::filesystem::path>& recordings,
                                    SessionScript* script);

// ParseSessionFile and FindInputs; also throws for missing inputs.
SessionScript ReadSessionFile(const std::filesystem::path& file,
                              const std::optional<std::filesystem::path>& recordings);

// Throws std::runtime_error if a session with live agents has a rate other than "1": live agents
// use the wall clock.
void CheckRate(const std::string& rate, const SessionScript& script);

// Converts `disconnect` faults to partitions of the agents' links, in wall time, for a session
// played at this rate ("1", "2", ...). Throws std::runtime_error at rate "max", which has no
// session time.
void PlaceDisconnects(const std::string& rate, SessionScript* script);

}  // namespace pangea::session
