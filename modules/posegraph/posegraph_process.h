#pragma once

// KEYFRAME_*, CONSTRAINT, PLACE_MATCH, REFINEMENT in; CORRECTION_k, MAP_STATE, STATUS_posegraph
// out.
//
// Keyframes are added in seq order, map by map; what is missing is asked for at ticks
// (RESEND_REQUEST, VERDICT_REQUEST, answers on AGAIN_posegraph): keyframes a gap or HAVE tells of,
// verification results that a PLACE_MATCH promised and that did not come in two seconds (then ever
// more rarely: it may only take its time, and a candidate of a match that the journal does not have
// may never be verified), and after a restart all of them. Live, when nothing has come for a
// second, and at the end of a replay (Finish) every group is solved from the beginning and
// published in full.
//
// After a restart nothing is told until the journal's keyframes and verification results are in, or
// for five seconds none of them came: half a map would be taken for what became of the whole. A
// verification result that the journal does not have either is not waited for: fusion may be behind
// by minutes. Whoever comes late asks for MAP_STATE, and the group is sent again.
//
// What already waits on the bus is added before anything is solved (at most kMaxWithoutUpdate of
// it): a solve costs the same after one verification result as after ten, and verification results
// that come faster than solves would make every correction late.
//
// Bounds: ReorderBuffer's for keyframes, those of due_results.h, the pose graph's own for
// constraints that wait for keyframes.

#include <string>

#include "bus/node.h"
#include "bus/process.h"
#include "bus/retransmission/journal_follower.h"
#include "messages/catch_up_messages.h"
#include "messages/state_chunks.h"
#include "pangea/map_state_t.hpp"
#include "posegraph/due_results.h"
#include "posegraph/posegraph.h"

namespace pangea {

class PoseGraphProcess : public Process {
 public:
  // Live, the first revision is the wall clock at the start, so that revisions rise over restarts.
  PoseGraphProcess(Bus& bus, const PoseGraphOptions& options, int64_t first_revision = 1,
                   const CheckpointPlace& checkpoint = {});

  void Tick(int64_t now_utime) override;
  // Solves and publishes all that is not yet; a second call adds nothing.
  void Finish();

  const PoseGraph& graph() const { return graph_; }

 private:
  static constexpr int kMaxWithoutUpdate = 100;

  void Save(ByteWriter* writer);
  bool Restore(ByteReader* reader);

  void OnKeyframe(const Keyframe& keyframe);
  void OnConstraint(const Constraint& constraint);
  void OnRefinement(MapState state, const map_state_t& message);
  void OnHave(const Have& have);
  void OnResendRequest(const ResendRequest& request);

  void UpdateUnlessMoreWaits();
  void Publish(const PoseGraphUpdate& update);
  void PublishStatus(int64_t now_utime);

  Node node_;
  PoseGraph graph_;
  JournalFollower journal_;
  StateChunks refinements_;
  DueResults results_;
  int64_t now_utime_ = 0;     // of the newest tick
  int64_t num_arrived_ = 0;   // keyframes, verification results
  int num_since_update_ = 0;  // messages added since the last update
  int64_t num_arrived_at_change_ = 0;
  int64_t last_change_utime_ = 0;
  int64_t num_finished_ = 0;  // num_arrived_ at the last Finish
  int64_t next_status_utime_ = 0;
};

}  // namespace pangea
