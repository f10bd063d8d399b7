#pragma once

// Thins a journal's maps: removes keyframes of places that newer maps show as well.
//
// Input: the journal's keyframes, verification results and anchor edits, in its order. Output: the
// removed keyframes (view_coverage.h), the odometry edges across the gaps, and the derived
// constraints that replace those of removed keyframes (node_removal.h).
//
// Kept completely are the maps of the last `keep_hours`, which may still be in use, and the oldest
// map of each group, whose odom frame is the map frame. Also kept are the keyframes that place an
// anchor, and the keyframes of constraints between maps that are not fused yet. Fused maps stay
// fused by derived constraints, which the pose graph trusts (posegraph/pair_evidence.h). This is
// tested with the pose graph: a group that would split is not thinned.
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
  // Maximum number of derived constraints at a keyframe; those with the smallest covariance are
  // kept.
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
  // The new edge of a kept keyframe whose odometry edge began at a removed one.
  struct Edge {
    std::optional<OdometryEdge> edge;
    std::optional<Preintegration> preintegration;
  };
  std::map<KeyframeId, Edge> edges;
  // All derived constraints (kind kDerived). They replace those of earlier thinnings.
  std::vector<Constraint> derived;
};

class Thinning {
 public:
  struct Options {
    ThinningOptions thinning;
    PoseGraphOptions posegraph;
  };

  // `records`: stores the keyframes' corners.
  Thinning(const Options& options, std::shared_ptr<RecordStore> records);

  // `journalled_utime`: when the keyframe was journalled, wall clock. One that comes behind later
  // ones of its map, as after damage, takes its place among them.
  void Take(const Keyframe& keyframe, int64_t journalled_utime);
  void Take(const Constraint& constraint);
  void Take(const AnchorEdit& edit);

  // `now_utime`: wall clock.
  ThinnedMaps Thin(int64_t now_utime);

 private:
  static constexpr int kNotStored = -1;
  struct StoredMap {
    std::vector<Keyframe> keyframes;  // ascending seq; without corners, only one map point
    std::vector<int> numbers;         // index in recognised_, or kNotStored
    int64_t journalled_utime = 0;     // of the newest keyframe
  };
  // The pose graph's solution for the keyframes that stay.
  struct Solution {
    std::map<KeyframeId, Rigid3> T_map_body;
    std::map<MapId, MapId> group_of;
    std::map<MapId, double> log_scale;
    std::set<int64_t> in_force;
    double odometry_scale = 1;  // factor on standard deviations
  };

  Solution Solve(const ThinnedMaps& without) const;
  void FillGraph(const ThinnedMaps& without, PoseGraph* graph) const;
  std::set<MapId> Whole(const Solution& solution, int64_t now_utime) const;
  void Keep(const AnchorEdit& place, std::set<KeyframeId>* must_stay) const;
  std::set<KeyframeId> MustStay(const Solution& solution) const;
  ThinnedMaps Make(const Solution& solution, const std::set<MapId>& whole);
  std::set<KeyframeId> Gone(const Solution& solution, const std::set<MapId>& whole);
  void JoinEdges(ThinnedMaps* thinned) const;
  NodeRemoval Removed(const Solution& solution, const std::set<KeyframeId>& gone) const;
  std::vector<Constraint> BestKnownFirst(const Solution& solution,
                                         const NodeRemoval& removed) const;
  std::vector<Constraint> Derive(const Solution& solution, const std::set<KeyframeId>& gone) const;
  // The groups that a map has left.
  std::set<MapId> ComeApart(const Solution& before, const ThinnedMaps& thinned) const;
  bool LookAlike(int a, int b);

  const Options options_;
  StoredKeyframes recognised_;
  std::vector<MapId> maps_;  // in order of arrival: the oldest first
  std::map<MapId, StoredMap> stored_;
  std::map<int64_t, Constraint> constraints_;  // by id
  AnchorRegistry anchors_;
};

}  // namespace pangea
