#pragma once

// The agent_handler between the link bus and the server bus.
//   link bus:   LINK_UP_* in; LINK_DOWN_k out
//   server bus: KEYFRAME_k, POSE_k, HAVE, AGAIN_*, RESEND_REQUEST, STATUS_agent_handler out;
//               PLACE_MATCH, CONSTRAINT, CORRECTION_k, RESEND_REQUEST, AGAIN_agent_handler in
// Keyframes are acknowledged and published once the journal's disk has them. What does not open
// under the key of the agent it claims to be from is dropped and counted; it costs one attempt to
// open it, and leaves nothing behind.

#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "agent_handler/agent_handler.h"
#include "agent_handler/journal.h"
#include "agent_handler/owed_questions.h"
#include "agent_handler/resend_queue.h"
#include "common/bus/missing.h"
#include "common/bus/node.h"
#include "common/link/agent_key.h"
#include "common/link/pacer.h"
#include "common/link/poll_loop.h"

namespace pangea {

struct AgentHandlerOptions {
  ReceiverOptions receiver;
  // Keyframes that arrive within this time share one write to the disk.
  int64_t sync_interval_us = 20'000;
  double resend_bytes_per_s = 6e6;
};

class AgentHandlerProcess : public PolledProcess {
 public:
  static constexpr size_t kMaxAgents = 64;  // beyond it, keys are refused

  // `now_utime`: wall clock. Throws if the journal or a key cannot be used.
  AgentHandlerProcess(Bus& link_bus, Bus& server_bus, const std::string& journal_path,
                      const std::string& key_folder, int64_t now_utime,
                      const AgentHandlerOptions& options);

  int Poll(int64_t steady_us) override;
  void Tick(int64_t now_utime) override;

 private:
  struct Agent {
    HandlerSession session;
    std::optional<AgentHandler> handler;  // since its first session
    int64_t packets = 0;                  // opened
    int64_t bytes_up = 0;
    int64_t bytes_down = 0;
    int64_t keyframes = 0;
  };
  // A keyframe in the journal's queue.
  struct Unsynced {
    KeyframeId id;
    std::vector<uint8_t> bytes;
    JournalPlace place;
  };

  void NoteJournalled(const KeyframeId& id);
  bool LoadEvent(const std::string& channel, Bytes data, const JournalPlace& place);
  void OnLinkUp(const std::string& channel, Bytes data);
  void SendDown(int32_t agent_id, Agent* agent, Bytes packet);
  void ReadKeys();
  void LookForKeys();
  AgentHandler MakeHandler(int32_t agent_id) const;
  void OnCorrection(const Correction& correction);
  void OnLandmarks(const landmarks_t& message);
  // Answers are place matches and constraints: of a journal that is read, and new ones.
  template <typename Message>
  bool LoadAnswer(Bytes data, const JournalPlace& place);
  template <typename Message>
  void OnAnswer(const std::string& channel, Bytes data);
  void JournalReady();
  void SyncJournal();
  void SendAcks();
  void AnswerResendRequests();
  void PublishHave();
  void AskForOwed(int64_t now_utime);
  void PublishStatus(int64_t now_utime);

  Bus& link_bus_;
  KeyFolder key_folder_;
  const AgentHandlerOptions options_;
  Node node_;
  JournalIndex index_;
  std::unique_ptr<Journal> journal_;
  std::map<int32_t, Agent> agents_;  // those with a key
  std::deque<Unsynced> unsynced_;
  int64_t oldest_unsynced_us_ = 0;
  std::map<MapId, int32_t> have_;  // highest seq on the disk
  std::vector<MapId> by_age_;      // of have_, in the journal's order
  OwedQuestions owed_;
  std::map<MapId, Correction> corrections_;  // the newest of each map, at most 1000
  MissingStates missing_corrections_;        // of the maps that were in the journal at the start
  ResendQueue resend_queue_;
  Pacer resend_pacer_;
  int64_t now_us_ = 0;
  int64_t now_utime_ = 0;
  int64_t next_have_utime_ = 0;
  int64_t next_status_utime_ = 0;
  bool disk_refuses_ = false;
};

}  // namespace pangea
