#pragma once

// Global visual-inertial bundle adjustment of fused groups (ORB-SLAM3's and COVINS' last step:
// Campos et al., TRO 2021; Schmuck et al., ISMAR 2021).
//
// In: keyframes, place matches, verification results, group states, in any order. Out: the refined
// state of a group: every keyframe's pose from all rays and all inertial measurements of all its
// agents at once. The pose graph's edges and loops carry each odometry's own scale; here one
// adjustment finds it from the whole flight, and landmarks that several agents see make it theirs
// together.
//
// A group is due when its loops or keyframes are not those of its last refinement, or when the pose
// graph has forgotten that one (it was started again). A large group is adjusted near what is new
// (local_part.h), the rest held where the last refinement has it; as a whole when it has none, when
// it has grown by half since it was (two groups that became one have), and when a local adjustment
// has moved what was adjusted before further than that may be wrong. Either way the refinement is
// of the whole group. Work goes in pieces, and is dropped when a message of its maps is taken. Map
// frame: the state's. One thread, no clock: the same calls in the same order give the same bytes.

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "core/group_states.h"
#include "core/record_store.h"
#include "core/server_messages.h"
#include "core/submap_store.h"
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
    int64_t dropped = 0;  // because of a message
    int64_t finished = 0;
    int64_t finished_local = 0;  // of these
  };

  // `records`: for keyframes and matches.
  explicit GlobalBa(const GlobalBaOptions& options, std::shared_ptr<RecordStore> records = nullptr);

  // Its record of a keyframe.
  static std::vector<uint8_t> RecordOf(const Keyframe& keyframe) {
    return SubmapStore::RecordOf(keyframe, kStore);
  }
  // What it was given but for states. Restored: false, and nothing has changed, if these are not
  // its bytes.
  void Save(ByteWriter* writer) const;
  bool Restore(ByteReader* reader);

  // Repeats change nothing.
  void Take(Keyframe keyframe);
  void Take(const PlaceMatch& match);
  void Take(const Constraint& constraint);
  // Whole; the highest revision wins, map by map.
  void Take(MapState state);

  // Whether a group is due or in work.
  bool HasWork() const { return work_ != nullptr || NextDue() != nullptr; }
  // One piece of work, if there is any. The refined state when that was the last.
  std::optional<MapState> Advance();

  const Counters& counters() const { return counters_; }
  size_t num_keyframes() const { return store_.size(); }
  const RecordCounters& store_counters() const { return store_.counters(); }

 private:
  using StatePointer = GroupStates<MapState>::Pointer;

  // What a refinement rests on.
  struct Basis {
    std::vector<MapId> maps;
    size_t keyframes = 0;
    int constraints = 0, switched_off = 0;
    bool operator==(const Basis&) const = default;
  };
  struct Refined {
    Basis basis;
    AdjustedGroup adjusted;
    size_t whole_keyframes = 0;  // of the group when it was last adjusted as a whole
    bool whole_is_due = false;
  };
  struct Work {
    StatePointer state;
    std::vector<KeyframePair> new_pairs;
    bool local = false;
    int passes = 0;  // that have ended
    MapPoses begin;  // where this one began
    std::unique_ptr<BaProblem> problem;
  };
  static constexpr SubmapStoreOptions kStore{.keep_preintegration = true};
  static Basis BasisOf(const MapState& state);
  static constexpr size_t kMaxMatched = 200'000;  // candidates; what comes beyond is not used

  StatePointer NextDue() const;
  bool IsLocal(const MapState& state, const MapPoses& poses) const;
  void Begin(StatePointer state);
  bool BeginAgain();
  // Matched pairs of the group that no refinement has.
  std::vector<KeyframePair> TakeNewPairs(const MapState& state, const MapPoses& poses);
  std::unique_ptr<BaProblem> Whole(const MapState& state, const MapPoses& poses);
  std::unique_ptr<BaProblem> Local(const MapPoses& poses);
  void AddPlace(const KeyframePair& pair, std::vector<MatchedPlaces>* places);
  void DropIfAbout(const MapId& map);
  MapState Finish();

  GlobalBaOptions options_;
  std::shared_ptr<RecordStore> records_;
  SubmapStore store_;
  std::map<KeyframePair, Record> matched_;  // corners, by place recognition
  MatchedPairs pairs_;
  std::set<KeyframePair> new_pairs_;  // not in the refinement of a group that has both ends
  GroupStates<MapState> states_;
  std::map<MapId, Refined> refined_;  // by group
  std::unique_ptr<Work> work_;
  Counters counters_;
};

}  // namespace pangea
