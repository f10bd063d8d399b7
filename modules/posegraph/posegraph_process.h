#pragma once

// In: KEYFRAME_*, CONSTRAINT, PLACE_MATCH, REFINEMENT. Out: CORRECTION_k, MAP_STATE,
// STATUS_posegraph.
//
// Keyframes are added in seq order, map by map. Missing messages are requested at ticks
// (RESEND_REQUEST, VERDICT_REQUEST; answers come on AGAIN_posegraph). These are: keyframes, where a
// gap in seq or a HAVE shows that they exist; verification results that a PLACE_MATCH promised and
// that did not arrive within two seconds (then at growing intervals: verification may be slow, and
// a candidate of a match that is not in the journal may never be verified); after a restart,
// everything. Each group is solved from the beginning and published in full when nothing has
// arrived for a second (live), and at the end of a replay (Finish).
//
// After a restart nothing is published until the journal's keyframes and verification results are
// in, or until none of them has arrived for five seconds: a receiver would take half a map for the
// whole. The process does not wait for a verification result that the journal does not have either:
// fusion may be minutes behind. A process that starts late requests MAP_STATE, and its group is
// published again.
//
// All messages that already wait on the bus are added before a solve (at most kMaxWithoutUpdate): a
// solve costs the same after one verification result as after ten, and if results came faster than
// solves, every correction would be late.
//
// Bounds: ReorderBuffer bounds the buffered keyframes, DueResults the promised results,
// ReceivedConstraints the constraints that wait for keyframes.

#include <optional>
#include <string>

#include "bus/node.h"
#include "bus/process.h"
#include "journal_follower/journal_follower.h"
#include "messages/catch_up_messages.h"
#include "messages/state_chunks.h"
#include "pangea/map_state_t.hpp"
#include "posegraph/due_results.h"
#include "posegraph/posegraph.h"

namespace pangea {

class PoseGraphProcess : public Process {
 public:
  // `start_utime`: only live (PoseGraph).
  PoseGraphProcess(Bus& bus, const PoseGraphOptions& options,
                   std::optional<int64_t> start_utime = {}, const CheckpointPlace& checkpoint = {});

  void Tick(int64_t now_utime) override;
  // Solves and publishes everything that is still due; a second call publishes nothing.
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
  int64_t num_arrived_ = 0;   // keyframes and verification results
  int num_since_update_ = 0;  // messages added since the last update
  int64_t num_arrived_at_change_ = 0;
  int64_t last_change_utime_ = 0;
  int64_t num_finished_ = 0;  // num_arrived_ at the last Finish
};

}  // namespace pangea
