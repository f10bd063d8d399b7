#pragma once

// The process around a PairJudge: KEYFRAME_* and PLACE_MATCH in, CONSTRAINT out, exactly one a
// candidate of its kind. A candidate about a keyframe not seen yet waits for it; what is missing is
// asked for at ticks (RESEND_REQUEST, answers on AGAIN_<name>). A verdict depends on the keyframes
// alone, not on when they came: live and replay agree, and a restart that repeats one repeats it
// exactly.
//
// Bounds: at most kMaxWaiting candidates wait; beyond that a match is not taken and asked for
// again later.

#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <variant>

#include "common/alignment/pair_judge.h"
#include "common/bus/bus.h"
#include "common/bus/in_order.h"
#include "common/bus/node.h"
#include "common/bus/process.h"
#include "pangea/again_t.hpp"
#include "pangea/have_t.hpp"
#include "pangea/keyframe_t.hpp"
#include "pangea/place_match_t.hpp"

namespace pangea {

class CandidateProcess : public Process {
 public:
  CandidateProcess(Bus& bus, const std::string& name, PlaceKind kind,
                   std::unique_ptr<PairJudge> judge);
  void Tick(int64_t now_utime) override;

 private:
  static constexpr size_t kMaxWaiting = 2000;

  // Which messages of each map are missing; asks for a gap that stays.
  class Tracker {
   public:
    void Note(const MapId& map, int32_t seq) { stream_.Add(map, seq, {}); }
    void Announce(const MapId& map, int32_t highest_seq) { stream_.Announce(map, highest_seq); }
    void Skip(const SeqGap& gap) { stream_.Skip(gap); }
    // The gaps that have stayed for a second, each at most every two.
    std::vector<SeqGap> Due(int64_t now_utime);

   private:
    struct Asked {
      int32_t from_seq = 0;
      int64_t next_utime = 0;
    };
    InOrder<std::monostate> stream_;
    std::map<MapId, Asked> asked_;
  };

  void OnKeyframe(const keyframe_t& message);
  void OnPlaceMatch(const place_match_t& message);
  void OnHave(const have_t& message);
  void OnAgain(const again_t& message);
  void JudgeReady();
  void Ask(const std::string& channel, const SeqGap& gap);

  Node node_;
  PlaceKind kind_;
  std::unique_ptr<PairJudge> judge_;
  Tracker keyframes_;
  Tracker matches_;
  std::map<std::pair<KeyframeId, KeyframeId>, PlaceCandidate> waiting_;  // by (query, match)
  std::set<int64_t> judged_;                                             // constraint ids
  std::set<MapId> verdicts_asked_;
  int64_t next_status_utime_ = 0;
  int64_t num_accepted_ = 0;
};

}  // namespace pangea
