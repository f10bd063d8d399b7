#pragma once

// A journal's maps without the keyframes of places that newer maps show as well.
//
// In: what the journal has, in its order: keyframes, verification results, anchor edits.
// Out: which keyframes stay (view_coverage.h), the odometry edges over the gaps, and the
// constraints that take the place of those whose keyframes go (node_removal.h).
//
// Whole stay the maps of the last `keep_hours`, which an agent may still be walking, and the oldest
// map of each group, whose odom is the map frame. So do the keyframes that place an anchor, and
// those that hold evidence between maps that are not fused yet. Maps that are fused stay fused by
// derived constraints, which the pose graph trusts (posegraph/pair_evidence.h). That is tried: of a
// group that would come apart nothing goes.
//
// Deterministic. One thread.

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <vector>

#include "anchors/anchor_registry.h"
#include "core/keyframe.h"
#include "core/record_store.h"
#include "core/server_messages.h"
#include "place_recognition/stored_keyframes.h"
#include "posegraph/posegraph.h"
#include "thinning/node_removal.h"
#include "thinning/view_coverage.h"

namespace pangea {

struct ThinningOptions {
  CoverageOptions coverage;
  double keep_hours = 24;
  // At one keyframe, constraints that took the place of others; the best known ones.
  int max_derived = 8;

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Section("coverage", &coverage, "which keyframes stay");
    archive.Add("keep_hours", &keep_hours, {0, 100000}, "h", "for which a map stays whole");
    archive.Add("max_derived", &max_derived, {1, 1000}, "",
                "constraints at a keyframe that took the place of others");
  }
};

struct ThinnedMaps {
  std::set<KeyframeId> gone;
  // Of keyframes that stay and whose odometry edge began at one that goes.
  struct Edge {
    std::optional<OdometryEdge> edge;
    std::optional<Preintegration> preintegration;
  };
  std::map<KeyframeId, Edge> edges;
  // All of kind kDerived; those of earlier thinnings are among them, or gone.
  std::vector<Constraint> derived;
};

class Thinning {
 public:
  struct Options {
    ThinningOptions thinning;
    PoseGraphOptions posegraph;
  };

  // `records`: for the keyframes' corners.
  Thinning(const Options& options, std::shared_ptr<RecordStore> records);

  // `journalled_utime`: wall clock.
  void Take(const Keyframe& keyframe, int64_t journalled_utime);
  void Take(const Constraint& constraint);
  void Take(const AnchorEdit& edit);

  // `now_utime`: wall clock.
  ThinnedMaps Thin(int64_t now_utime);

 private:
  static constexpr int kNotStored = -1;
  struct StoredMap {
    std::vector<Keyframe> keyframes;  // ascending seq; without corners, with one point
    std::vector<int> numbers;         // in recognised_, or kNotStored
    int64_t journalled_utime = 0;     // the newest
  };
  // What the pose graph says of the keyframes that stay.
  struct Solution {
    std::map<KeyframeId, Rigid3> T_map_body;
    std::map<MapId, MapId> group_of;
    std::set<int64_t> in_force;
    double odometry_scale = 1;  // standard deviations
  };

  Solution Solve(const ThinnedMaps& without) const;
  std::set<MapId> Whole(const Solution& solution, int64_t now_utime) const;
  std::set<KeyframeId> MustStay(const Solution& solution) const;
  ThinnedMaps Make(const Solution& solution, const std::set<MapId>& whole);
  std::set<KeyframeId> Gone(const Solution& solution, const std::set<MapId>& whole);
  void JoinEdges(ThinnedMaps* thinned) const;
  NodeRemoval Removed(const Solution& solution, const std::set<KeyframeId>& gone) const;
  std::vector<Constraint> BestKnownFirst(const Solution& solution,
                                         const NodeRemoval& removed) const;
  std::vector<Constraint> Derive(const Solution& solution, const std::set<KeyframeId>& gone) const;
  // Groups of which a map is no longer in.
  std::set<MapId> ComeApart(const Solution& before, const ThinnedMaps& thinned) const;
  bool LookAlike(int a, int b);

  const Options options_;
  StoredKeyframes recognised_;
  std::vector<MapId> maps_;  // in the order they came: the oldest first
  std::map<MapId, StoredMap> stored_;
  std::map<int64_t, Constraint> constraints_;  // by id
  AnchorRegistry anchors_;
};

}  // namespace pangea
