#pragma once

// The agent_handler between the link bus and the server bus.
//   link bus:   LINK_UP_* in; LINK_DOWN_k out
//   server bus: POSE_k, STATUS_agent_handler and what archive.h says out; CORRECTION_k,
//               LANDMARKS_k, OTHERS_k and what archive.h and anchor_relay.h say in
// Keyframes are published once the journal's disk has them, and acknowledged once they are kept
// (journal/replication.h). What does not open
// under the key of the agent it claims to be from is dropped and counted; it costs one attempt to
// open it, and leaves nothing behind.

#include <map>
#include <optional>
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
  // Beyond it, keys are refused: 210 MB of receive caches when all are full.
  static constexpr size_t kMaxAgents = KeyFolder::kMaxKeys;

  // `now_utime`: wall clock. Throws if the journal or a key cannot be used.
  AgentHandlerProcess(Bus& link_bus, Bus& server_bus, const std::string& journal_path,
                      const std::string& key_folder, int64_t now_utime,
                      const AgentHandlerOptions& options);

  int Poll(int64_t steady_us) override;
  void Tick(int64_t now_utime) override;

  // When it was opened.
  bool journal_was_damaged() const { return !archive_.Damage().empty(); }

 private:
  struct Agent {
    HandlerSession session;
    std::optional<AgentHandler> handler;  // since its first session
    int64_t packets = 0;                  // opened
    int64_t heard_us = 0;                 // the newest of them
    int hellos_refused = 0;               // since one was opened
    int64_t bytes_up = 0;
    int64_t bytes_down = 0;
    int64_t keyframes = 0;
  };
  void OnLinkUp(const std::string& channel, Bytes data);
  // The bytes on the wire.
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
  // For people: agents whose software is not of this version.
  std::string OtherSoftware() const;
  // For people: the files in the folder of keys that let nobody in.
  std::string UnusableKeys() const;
  // For people: agents who say hello under another key.
  std::string OtherKeys() const;
  void PublishStatus(int64_t now_utime);

  Bus& link_bus_;
  const std::string key_folder_name_;
  KeyFolder key_folder_;
  const AgentHandlerOptions options_;
  Node node_;
  Archive archive_;
  AnchorRelay anchors_;
  std::map<int32_t, Agent> agents_;          // those with a key
  std::map<MapId, Correction> corrections_;  // the newest of each map, at most 16,000
  MissingStates missing_corrections_;        // of the maps that were in the journal at the start
  int64_t now_us_ = 0;
  int64_t next_have_utime_ = 0;
  int64_t next_status_utime_ = 0;
};

}  // namespace pangea
