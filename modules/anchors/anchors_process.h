#pragma once

// In: KEYFRAME_*, MAP_STATE, CORRECTION_*, POSE_*, ANCHOR_EDIT, HAVE. Out: ANCHOR_k, ANCHOR,
// OTHERS_k, STATUS_anchors.
//
// Edits are applied in the journal's order. Missing ones are requested at ticks (RESEND_REQUEST,
// answers on AGAIN_anchors); agent_handler repeats the newest one, so that lost edits at the end
// are noticed. Messages to agents are paced by the clock (anchor_updates.h). In a replay there is
// no receiver, so only ANCHOR is published, at the end (Finish).

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
#include "bus/retransmission/reorder_buffer.h"
#include "journal_follower/journal_follower.h"
#include "messages/state_chunks.h"
#include "pangea/again_t.hpp"
#include "pangea/map_state_t.hpp"
#include "pangea/pose_t.hpp"

namespace pangea {

class AnchorsProcess : public Process {
 public:
  // `records`: stores map points (odometry_track.h); may be null.
  AnchorsProcess(Bus& bus, const AnchorsOptions& options,
                 std::shared_ptr<RecordStore> records = nullptr);

  void Tick(int64_t now_utime) override;
  // Publishes the pose of every anchor on ANCHOR.
  void Finish();

  const Anchors& anchors() const { return anchors_; }

  // Requests that agent_handler journals an edit made by a tool on the server (agent 0).
  void Request(const AnchorEdit& edit);
  // Sets a function that is called with each edit of the journal after it was applied, and with the
  // reason if it was refused.
  using EditHandler = std::function<void(const AnchorEdit&, const std::string& refused)>;
  void OnEditTaken(EditHandler handler) { on_edit_taken_ = std::move(handler); }
  // Whether the whole journal was received, as far as can be known.
  bool is_complete() const;

 private:
  void OnMapState(MapState state, const map_state_t& message);
  void OnEdit(AnchorEdit edit);
  void OnPose(const pose_t& message);
  void RequestMissingEdits(int64_t now_utime);
  void PlaceInEndedMaps(int64_t now_utime);
  void PublishDue(int64_t now_utime);
  void PublishOthers(int64_t now_utime);
  void PublishStatus(int64_t now_utime);

  EditHandler on_edit_taken_;
  Node node_;
  Anchors anchors_;
  JournalFollower journal_;
  StateChunks states_;
  ReorderBuffer<AnchorEdit> edits_;  // a single stream
  AnchorUpdates for_watchers_;
  std::map<MapId, AnchorUpdates> for_agents_;  // key: current map of an agent
  OtherAgents other_agents_;
  bool have_received_ = false;
  int64_t have_utime_ = 0;  // of the first tick after the first HAVE
  int64_t now_utime_ = 0;
  int64_t next_request_utime_ = 0;
  int64_t next_ended_utime_ = 0;
  bool was_complete_ = false;
  int64_t next_publish_utime_ = 0;
  int64_t next_others_utime_ = 0;
};

}  // namespace pangea
