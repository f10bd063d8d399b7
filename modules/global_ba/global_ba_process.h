#pragma once

// KEYFRAME_*, PLACE_MATCH, CONSTRAINT, MAP_STATE in; REFINEMENT, STATUS_global_ba out.
//
// Works while the bus is quiet: three seconds after the last news a group is adjusted, in pieces
// between which messages are handled, and dropped when they are news. So it takes no time from a
// session that runs; a replay calls Finish.
//
// What is missing is asked for at ticks (RESEND_REQUEST, answers on AGAIN_global_ba): keyframes and
// matches that a gap or HAVE tells of, and once per map the verdicts of a former run. A verdict
// that is lost later costs its matches, nothing else.

#include <map>
#include <set>
#include <string>
#include <variant>

#include "common/bus/in_order.h"
#include "common/bus/node.h"
#include "common/bus/process.h"
#include "common/state_chunks.h"
#include "global_ba/global_ba.h"
#include "pangea/again_t.hpp"
#include "pangea/constraint_t.hpp"
#include "pangea/have_t.hpp"
#include "pangea/keyframe_t.hpp"
#include "pangea/map_state_t.hpp"
#include "pangea/place_match_t.hpp"

namespace pangea {

class GlobalBaProcess : public Process {
 public:
  GlobalBaProcess(Bus& bus, const GlobalBaOptions& options);

  void Tick(int64_t now_utime) override;
  // All that is due, to its end.
  void Finish();

 private:
  using Stream = InOrder<std::monostate>;
  struct Asked {
    int32_t from_seq = -1;
    int64_t next_utime = 0;
    int times = 0;
  };

  void OnKeyframe(const keyframe_t& message);
  void OnPlaceMatch(const place_match_t& message);
  void OnConstraint(const constraint_t& message);
  void OnMapState(const map_state_t& message);
  void OnHave(const have_t& message);
  void OnAgain(const again_t& message);

  void Advance();
  void AskFor(Stream* stream, std::map<MapId, Asked>* asked, bool keyframes, int64_t now_utime);
  void Ask(const std::string& channel, const MapId& map, int32_t from_seq, int32_t to_seq);
  void PublishStatus(int64_t now_utime);

  Node node_;
  GlobalBa global_ba_;
  StateChunks chunks_;
  Stream keyframes_;
  Stream matches_;
  std::map<MapId, Asked> keyframes_asked_;
  std::map<MapId, Asked> matches_asked_;
  std::set<MapId> verdicts_asked_;  // maps whose verdicts of a former run were asked for
  int64_t num_news_ = 0;
  int64_t num_news_at_change_ = 0;
  int64_t last_news_utime_ = 0;
  int64_t next_status_utime_ = 0;
};

}  // namespace pangea
