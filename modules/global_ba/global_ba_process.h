#pragma once

// KEYFRAME_*, PLACE_MATCH, CONSTRAINT, MAP_STATE in; REFINEMENT, STATUS_global_ba out.
//
// Works while the bus is quiet: three seconds after the last message a group is adjusted, in pieces
// between which messages are handled, and dropped when they change anything. So it takes no time
// from a session that runs; a replay calls Finish.
//
// What is missing is asked for at ticks (RESEND_REQUEST, answers on AGAIN_global_ba): keyframes and
// matches that a gap or HAVE tells of, once per map the verification results of a former run, and
// the states that were said before this process came. A verification result that is lost later
// costs its matches, nothing else.

#include <set>

#include "bus/node.h"
#include "bus/process.h"
#include "bus/retransmission/missing.h"
#include "global_ba/global_ba.h"
#include "messages/catch_up_messages.h"
#include "messages/state_chunks.h"
#include "pangea/again_t.hpp"
#include "pangea/map_state_t.hpp"

namespace pangea {

class GlobalBaProcess : public Process {
 public:
  GlobalBaProcess(Bus& bus, const GlobalBaOptions& options);

  void Tick(int64_t now_utime) override;
  // All that is due, to its end.
  void Finish();

 private:
  void OnKeyframe(Keyframe keyframe);
  void OnPlaceMatch(const PlaceMatch& match);
  void OnConstraint(const Constraint& constraint);
  void OnMapState(MapState state, const map_state_t& message);
  void OnHave(const Have& have);
  void OnRetransmission(const again_t& message);

  void Advance();
  void PublishStatus(int64_t now_utime);

  Node node_;
  GlobalBa global_ba_;
  StateChunks chunks_;
  MissingMessages keyframes_;
  MissingMessages matches_;
  MissingStates missing_states_;
  std::set<MapId>
      results_requested_;  // maps whose verification results of a former run were asked for
  int64_t num_inputs_ = 0;
  int64_t num_inputs_at_change_ = 0;
  int64_t last_input_utime_ = 0;
  int64_t next_status_utime_ = 0;
};

}  // namespace pangea
