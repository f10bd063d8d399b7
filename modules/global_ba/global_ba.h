#pragma once

// Global visual-inertial bundle adjustment of fused groups (like the last step of ORB-SLAM3, Campos
// et al., TRO 2021, and of COVINS, Schmuck et al., ISMAR 2021).
//
// Input: keyframes, place matches, verification results and group states, in any order. Output: the
// refined state of a group: the keyframes' poses, estimated from all rays and inertial measurements
// of all its agents together. In the pose graph, edges and loops have the scale of each odometry;
// here the scale is estimated from the whole session, and landmarks seen by several agents make it
// common to them.
//
// A group is due if its loops or keyframes differ from those of its last refinement, or if the pose
// graph has lost that refinement (it was restarted). A large group is adjusted only near new
// keyframes and matches (local_part.h); the rest is fixed at the last refinement. It is adjusted as
// a whole if it has no refinement, if a local adjustment has moved adjusted keyframes by more than
// max_shift_m, or if it has doubled since its last whole adjustment (as after a fusion of two
// groups) and has at most 250 keyframes. In all cases the refinement contains the whole group. A
// state is adjusted once: the pose graph takes a second refinement of the same revision for a
// repeat. The work is done in pieces, and abandoned when a message about its maps arrives. Map
// frame: that of the state. One thread, no clock: the same calls in the same order give the same
// bytes.

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "core/group_states.h"
#include "core/keyframe_store.h"
#include "core/record_store.h"
#include "core/server_messages.h"
#include "global_ba/ba_problem.h"
#include "global_ba/group_world.h"
#include "global_ba/local_part.h"
#include "global_ba/matched_pairs.h"

namespace pangea {

struct GlobalBaOptions {
  BaOptions ba;
  LocalOptions local;

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Section("local", &local, "adjustments of a part of a large group");
    archive.Section("ba", &ba, "bundle adjustment");
  }
};

class GlobalBa {
 public:
  struct Counters {
    int64_t begun = 0;
    int64_t dropped = 0;  // abandoned because of a message
    int64_t finished = 0;
    int64_t finished_local = 0;  // of the finished ones
  };

  // `records`: stores keyframes and matches; null: they stay in memory.
  explicit GlobalBa(const GlobalBaOptions& options, std::shared_ptr<RecordStore> records = nullptr);

  // The record of a keyframe, as it is stored in `records`.
  static std::vector<uint8_t> RecordOf(const Keyframe& keyframe) {
    return KeyframeStore::RecordOf(keyframe, kStore);
  }
  // Saves its input, except states. Restore returns false, and changes nothing, if the bytes are
  // not those of a GlobalBa.
  void Save(ByteWriter* writer) const;
  bool Restore(ByteReader* reader);

  // Repeats are ignored.
  void Take(Keyframe keyframe);
  void Take(const PlaceMatch& match);
  void Take(const Constraint& constraint);
  // A complete state (not a chunk). For each map the state with the highest revision counts.
  void Take(MapState state);

  // Whether an adjustment is due or running.
  bool HasWork() const { return work_ != nullptr || NextDue() != nullptr; }
  // Does one piece of work, if there is any. Returns the refined state after the last piece.
  std::optional<MapState> Advance();

  // The last refinement of the map's group; null if there is none in use.
  const MapState* RefinementOf(const MapId& map) const;

  const Counters& counters() const { return counters_; }
  size_t num_keyframes() const { return store_.size(); }
  const RecordCounters& store_counters() const { return store_.counters(); }

 private:
  using StatePointer = GroupStates<MapState>::Pointer;

  // The input that a refinement was made from, to detect changes.
  struct Basis {
    std::vector<MapId> maps;
    size_t keyframes = 0;
    int constraints = 0, switched_off = 0;
    bool operator==(const Basis&) const = default;
  };
  struct Refined {
    Basis basis;
    MapState state;  // as returned by Advance
    AdjustedGroup adjusted;
    size_t whole_keyframes = 0;  // size of the group at its last whole adjustment
    bool whole_is_due = false;
  };
  struct Work {
    StatePointer state;
    std::vector<KeyframePair> new_pairs;
    bool local = false;
    int passes = 0;  // finished passes
    MapPoses begin;  // poses at the start of this pass
    std::unique_ptr<BaProblem> problem;
  };
  static constexpr KeyframeStoreOptions kStore{.keep_preintegration = true};
  static Basis BasisOf(const MapState& state);
  // Candidates; further ones are not used. Place recognition remembers 100,000 keyframes, and finds
  // up to eight candidates for each.
  static constexpr size_t kMaxMatched = 1'000'000;

  StatePointer NextDue() const;
  bool IsDue(const MapState& state) const;
  bool IsLocal(const MapState& state, const MapPoses& poses) const;
  void Begin(StatePointer state);
  bool BeginAgain();
  // Takes from new_pairs_ the matched pairs with both ends in the group.
  std::vector<KeyframePair> TakeNewPairs(const MapState& state, const MapPoses& poses);
  std::unique_ptr<BaProblem> Whole(const MapState& state, const MapPoses& poses);
  std::unique_ptr<BaProblem> Local(const MapPoses& poses);
  void AddPair(const KeyframePair& pair, std::vector<MatchedPair>* pairs);
  void DropIfAbout(const MapId& map);
  MapState Finish();

  GlobalBaOptions options_;
  std::shared_ptr<RecordStore> records_;
  KeyframeStore store_;
  std::map<KeyframePair, Record> matched_;  // matched corners, from place recognition
  MatchedPairs pairs_;
  std::set<KeyframePair> new_pairs_;  // matched pairs that no refinement contains
  GroupStates<MapState> states_;
  std::map<MapId, Refined> refined_;  // key: the group's id
  std::unique_ptr<Work> work_;
  Counters counters_;
};

}  // namespace pangea
