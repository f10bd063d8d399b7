#pragma once

// KEYFRAME_*, MAP_STATE, CORRECTION_*, POSE_*, ANCHOR_EDIT, HAVE in; ANCHOR_k, ANCHOR, OTHERS_k,
// STATUS_anchors out.
//
// Edits are taken in the journal's order: what is missing is asked for at ticks (RESEND_REQUEST,
// answers on AGAIN_anchors), and agent_handler repeats the newest, so that a lost tail shows. What
// agents are told is paced by the clock (anchor_updates.h); in a replay nobody listens, and only
// ANCHOR is said, at the end (Finish).

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include "anchors/anchor_updates.h"
#include "anchors/anchors.h"
#include "anchors/other_agents.h"
#include "bus/node.h"
#include "bus/process.h"
#include "bus/retransmission/journal_follower.h"
#include "bus/retransmission/reorder_buffer.h"
#include "messages/state_chunks.h"
#include "pangea/again_t.hpp"
#include "pangea/map_state_t.hpp"
#include "pangea/pose_t.hpp"

namespace pangea {

class AnchorsProcess : public Process {
 public:
  // `records`: what it sets aside; may be null.
  AnchorsProcess(Bus& bus, const AnchorsOptions& options,
                 std::shared_ptr<RecordStore> records = nullptr);

  void Tick(int64_t now_utime) override;
  // Says where every anchor is.
  void Finish();

  const Anchors& anchors() const { return anchors_; }

  // Asks agent_handler to journal an edit of a tool on the server (agent 0).
  void Request(const AnchorEdit& edit);
  // Called with each edit of the journal once it is taken, or why it was refused.
  using EditHandler = std::function<void(const AnchorEdit&, const std::string& refused)>;
  void OnEditTaken(EditHandler handler) { on_edit_taken_ = std::move(handler); }
  // All of the journal was heard, as far as anybody can tell.
  bool is_complete() const;

 private:
  void OnMapState(MapState state, const map_state_t& message);
  void OnEdit(AnchorEdit edit);
  void OnPose(const pose_t& message);
  void RequestMissingEdits(int64_t now_utime);
  void PublishDue(int64_t now_utime);
  void PublishOthers(int64_t now_utime);
  void PublishStatus(int64_t now_utime);

  EditHandler on_edit_taken_;
  Node node_;
  Anchors anchors_;
  JournalFollower journal_;
  StateChunks states_;
  ReorderBuffer<AnchorEdit> edits_;  // one stream
  AnchorUpdates for_watchers_;
  std::map<MapId, AnchorUpdates> for_agents_;  // the newest map of each
  OtherAgents other_agents_;
  bool have_received_ = false;
  int64_t have_utime_ = 0;  // of the first tick after the first HAVE
  int64_t now_utime_ = 0;
  int64_t next_request_utime_ = 0;
  int64_t next_publish_utime_ = 0;
  int64_t next_others_utime_ = 0;
  int64_t next_status_utime_ = 0;
};

}  // namespace pangea
