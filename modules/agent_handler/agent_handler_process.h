#pragma once

// The agent_handler process, between the link bus and the server bus.
//   link bus:   LINK_UP_* in; LINK_DOWN_k out
//   server bus: POSE_k, STATUS_agent_handler and what archive.h says out; CORRECTION_k,
//               LANDMARKS_k, OTHERS_k and what archive.h and anchor_relay.h say in
// A keyframe is published when it is on the journal's disk, and acknowledged when it is kept
// (journal/replication.h). A packet that cannot be decrypted with the key of the agent on whose
// channel it came is counted and dropped; it costs one attempt and changes no state.

#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "agent_handler/agent_handler.h"
#include "agent_handler/agent_handler_options.h"
#include "agent_handler/anchor_relay.h"
#include "agent_handler/journal/archive.h"
#include "bus/node.h"
#include "bus/retransmission/missing.h"
#include "link/agent_key.h"
#include "link/poll_loop.h"

namespace pangea {

class AgentHandlerProcess : public PolledProcess {
 public:
  // Further keys are refused. The receive caches of all agents take at most 1 GB.
  static constexpr size_t kMaxAgents = KeyFolder::kMaxKeys;

  // `now_utime`: wall clock. `before_mend`: as for Journal. Throws std::runtime_error if the
  // journal or the folder of keys cannot be used.
  AgentHandlerProcess(Bus& link_bus, Bus& server_bus, const std::string& journal_path,
                      const std::string& key_folder, int64_t now_utime,
                      const AgentHandlerOptions& options,
                      const std::function<void()>& before_mend = nullptr);

  int Poll(int64_t steady_us) override;
  void Tick(int64_t now_utime) override;

 private:
  struct Agent {
    HandlerSession session;
    std::optional<AgentHandler> handler;  // made by the first session
    int64_t packets = 0;                  // number of packets that were decrypted
    int64_t heard_us = 0;                 // when the newest of them came
    bool new_uplink = false;              // opened a session that the handler was not told of
    int hellos_refused = 0;               // hellos refused since the last packet was decrypted
    int64_t bytes_up = 0;
    int64_t bytes_down = 0;
    int64_t keyframes = 0;
  };
  void OnLinkUp(const std::string& channel, Bytes data);
  void RefuseStranger(int32_t agent_id);
  // A line in the log about an agent, once; pangea-server shows it.
  void TellOnce(int32_t agent_id, const std::string& what);
  bool HasJoined(int32_t agent_id, Agent* agent);
  void TakePacket(int32_t agent_id, Agent* agent, const HandlerSession::Opened& opened);
  // Whether the agent's uplink sent something lately.
  bool IsThere(const Agent& agent) const;
  // Returns the packet's bytes on the wire.
  int64_t SendDown(int32_t agent_id, Agent* agent, Bytes packet);
  void ReadKeys();
  void LookForKeys();
  AgentHandler MakeHandler(int32_t agent_id) const;
  void OnCorrection(const Correction& correction);
  void OnLandmarks(const MapLandmarks& landmarks, const landmarks_t& message);
  void OnOthers(const Others& others, const others_t& message);
  void SendBestEffort(int32_t agent_id, LinkKind kind, std::vector<uint8_t> body);
  void JournalReady(Agent* agent);
  void SendAcks();
  void SendAnchors();
  // For people: the agents whose software has another version than this program.
  std::string OtherSoftware() const;
  // For people: the files in the folder of keys that cannot be used.
  std::string UnusableKeys() const;
  // For people: the agents whose hellos are sealed under another key.
  std::string OtherKeys() const;
  void PublishStatus(int64_t now_utime);

  Bus& link_bus_;
  const std::string key_folder_name_;
  KeyFolder key_folder_;
  const AgentHandlerOptions options_;
  Node node_;
  Archive archive_;
  AnchorRelay anchors_;
  std::map<int32_t, Agent> agents_;                 // all agents with a key
  std::set<int32_t> strangers_;                     // agents without one, the first kMaxStrangers
  std::set<std::pair<int32_t, std::string>> told_;  // by TellOnce
  std::map<MapId, Correction> corrections_;         // the newest one of each map, at most 16,000
  MissingStates missing_corrections_;  // for maps that were in the journal at the start
  int64_t now_us_ = 0;
  int64_t next_have_utime_ = 0;
};

}  // namespace pangea
