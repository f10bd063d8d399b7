#pragma once

// What a server process needs to follow the journal: keyframes, PLACE_MATCHes and verification
// results reach it once they come, whether they were published, retransmitted, or written before it
// started. In: KEYFRAME_*, PLACE_MATCH, CONSTRAINT, HAVE, AGAIN_<process>. Out: RESEND_REQUEST at
// ticks, for what a gap or HAVE tells of; once per map for the results of former runs; and for the
// states of maps that were there before this process. The time-outs: timeouts.h.
//
// In order: keyframes come in seq order, map by map. Those that are lost (an edge or HAVE says so)
// are passed over and counted as dropped; with `gives_up` also those that nobody sends.
//
// A process is catching up while keyframes and matches are missing that the journal had of a map
// when this process knew nothing of it; not for longer than kCatchUpSilence_us without progress.
// When it first is not, the status says so: counter `ready_utime`, wall clock.
// Bounds: InOrder's. One thread; lives as long as its node.

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>

#include "bus/node.h"
#include "bus/retransmission/gap_requests.h"
#include "bus/retransmission/in_order.h"
#include "bus/retransmission/missing.h"
#include "messages/catch_up_messages.h"
#include "pangea/again_t.hpp"

namespace pangea {

class JournalFollower {
 public:
  // Of former runs: the process makes them itself, and is to know what it said before.
  enum class Which : uint8_t { kNone, kOfFormerRuns, kAll };

  struct Follows {
    bool in_order = false;  // keyframes
    bool gives_up = false;  // keyframes that nobody sends, of those in order
    Which matches = Which::kNone;
    Which results = Which::kNone;
    bool states = false;  // the process says by NoteStates which came
  };

  // Those that are empty are not called.
  struct Handlers {
    std::function<void(Keyframe)> keyframe = {};
    // One came, also where it waits for those before it.
    std::function<void(const KeyframeId&)> keyframe_came = {};
    // Whether it was taken; if not, it is asked for again.
    std::function<bool(PlaceMatch)> match = {};
    std::function<void(const Constraint&)> result = {};
    std::function<void(const Have&)> have = {};  // before what follows from it
    // A retransmission of something else; whether it was asked for.
    std::function<bool(const again_t&)> other = {};
    // What else of the journal is still to come, in a catch-up.
    std::function<int64_t()> more_to_catch_up = {};
    std::function<void()> handled = {};  // after each message
  };

  JournalFollower(Node& node, const Follows& follows, Handlers handlers);

  // At about 10 Hz. `ask_for_matches`: not while the process has no room for them.
  void Tick(int64_t now_utime, bool ask_for_matches = true);
  void NoteStates(const std::vector<MapId>& maps) { states_.Note(maps); }

  bool catching_up() const { return !goal_.empty() || !states_.empty(); }
  // Keyframes, maps' matches and what the process has to add.
  int64_t num_to_catch_up() const;
  // The process goes on with what it has.
  void StopCatchingUp();

  // The map's first seq that did not come.
  int32_t next(const MapId& map) const { return keyframes_.next(map); }
  bool HasMatch(const KeyframeId& query) const { return matches_.Has(query.map, query.seq); }
  // Up to what seq the journal had the map, in a catch-up.
  std::optional<int32_t> Goal(const MapId& map) const;
  // Keyframes that wait for those before them.
  size_t parked() const { return keyframes_.parked(); }

 private:
  // Nothing: a seq that will never come, or that was handed on out of order.
  using Item = std::optional<Keyframe>;

  void OnKeyframe(Keyframe keyframe);
  void OnMatch(PlaceMatch match);
  void OnResult(const Constraint& result);
  void OnHave(const Have& have);
  void OnRetransmission(const again_t& again);

  void TakeNewMap(const MapId& map, int32_t highest_seq);
  void AddInOrder(Keyframe keyframe);
  void Lose(const SeqGap& gap);
  void Skip(const SeqGap& gap);
  void HandOn(std::vector<Item> ready);
  void Handled();
  void AskForKeyframes(int64_t now_utime);
  int64_t NumMissing() const;
  void CatchUp(int64_t now_utime);
  void NoteReady(int64_t now_utime);

  Node& node_;
  const Follows follows_;
  const Handlers handlers_;
  InOrder<Item> keyframes_;
  GapRequests keyframe_requests_;
  MissingMessages matches_;
  MissingStates states_;
  std::set<MapId> named_;  // maps that HAVE told of
  // What the journal had of each map when this process came, until that is in.
  std::map<MapId, int32_t> goal_;
  int64_t num_to_catch_up_ = 0;
  int64_t progress_utime_ = 0;  // when that fell last
  bool have_received_ = false;
  bool ready_ = false;  // once, at least
};

}  // namespace pangea
