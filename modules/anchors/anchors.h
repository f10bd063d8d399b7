#pragma once

// The anchors of all maps, and where each is for whom.
//
// In: keyframes (in the order of their maps), edits (in the journal's order), whole group states,
// corrections. Out: for an agent, the anchors of its group near it, in its odom frame; for watchers
// all anchors in their group's frame. An anchor is held by keyframes (placement.h), so it follows
// when the pose graph or a bundle adjustment moves these, when maps are fused, and when a fusion is
// undone.
//
// No clock, no thread: the same calls give the same results. Bounded: max_anchors, and what
// odometry_track.h has of a keyframe.

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "anchors/anchor_registry.h"
#include "anchors/odometry_track.h"
#include "anchors/placement.h"
#include "core/anchor.h"
#include "core/group_states.h"
#include "core/record_store.h"
#include "core/server_messages.h"

namespace pangea {

struct AnchorsOptions {
  int max_anchors = 10000;
  double near_m = 50;  // from an agent
  int max_near = 64;   // sent to one agent

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("max_anchors", &max_anchors, {1, 1e6}, "", "that are not deleted");
    archive.Add("near_m", &near_m, {0.1, 1e5}, "m", "from an agent to the anchors it hears of");
    archive.Add("max_near", &max_near, {1, 256}, "", "anchors an agent hears of, the nearest");
  }
};

class Anchors {
 public:
  // `records` may be null.
  explicit Anchors(const AnchorsOptions& options, std::shared_ptr<RecordStore> records = nullptr)
      : options_(options),
        records_(std::move(records)),
        registry_(static_cast<size_t>(options.max_anchors)) {}

  void Take(const Keyframe& keyframe);
  // Why it is refused, or an empty string.
  std::string Take(const AnchorEdit& edit);
  // Whole; the highest revision wins, map by map.
  void Take(const MapState& state);
  void Take(const Correction& correction);

  // The agents' maps: of each the newest.
  std::vector<MapId> AgentMaps() const;
  // Those near the map's newest keyframe, the nearest first; and those that are gone for it:
  // deleted (the newest max_near), and of those `told` before what is in no group with it any more.
  // Empty for a map without keyframes.
  std::vector<AnchorState> ForAgent(const MapId& map, const std::set<AnchorId>& told = {}) const;
  // Every placed anchor in its group's frame, and those that were deleted.
  std::vector<AnchorState> All() const;

  // What all edits together say, also of anchors that are not placed.
  const AnchorRegistry& registry() const { return registry_; }
  // One in its group's frame; nothing for one that is not placed.
  std::optional<AnchorState> InItsGroup(const AnchorId& id) const;
  // The group that a map belongs to, and its revision; the map itself and 0 while it is alone.
  std::pair<MapId, int64_t> GroupAndRevision(const MapId& map) const;
  // The newest odom frame in the group's frame; of a map that is in no group the identity.
  Rigid3 T_map_odom(const MapId& map) const;
  // Of a map's newest keyframe; nothing for a map without keyframes.
  std::optional<Rigid3> T_body_cam(const MapId& map) const;
  // Of a group's keyframes the nearest to a point in its frame (metres); nothing for what is not,
  // or no longer, the id of a group that has keyframes.
  struct NearKeyframe {
    KeyframeId id;
    Rigid3 T_map_body;
  };
  std::optional<NearKeyframe> NearestKeyframe(const MapId& group,
                                              const Eigen::Vector3d& p_map) const;
  // Where an edit would put its anchor, as far as the maps have come.
  PlacementResult Try(const AnchorEdit& edit) const;

  size_t num_anchors() const { return registry_.entries().size() - registry_.num_deleted(); }
  size_t num_placed() const;
  RecordCounters store_counters() const;
  const RecordStore* records() const { return records_.get(); }
  size_t num_waiting() const { return waiting_.size(); }
  // Why anchors could not be placed, since the last call.
  std::vector<std::string> TakeNotPlaced() { return std::exchange(not_placed_, {}); }

 private:
  // Where something is in a group.
  struct InGroup {
    Rigid3 T_map_anchor;
    Matrix6d covariance;
  };

  void PlaceOrWait(const AnchorId& id);
  Rigid3 T_map_body(const MapId& map, int32_t seq) const;
  InGroup Position(const AnchorPlacement& placement) const;
  // Of each placed anchor.
  const std::map<AnchorId, InGroup>& Positions() const;
  bool SameGroup(const MapId& a, const MapId& b) const;
  // Without its place.
  AnchorState Describe(const AnchorId& id, const MapId& map) const;
  std::vector<AnchorId> DeletedOf(const MapId& map) const;

  const AnchorsOptions options_;
  const std::shared_ptr<RecordStore> records_;
  AnchorRegistry registry_;
  std::map<MapId, OdometryTrack> tracks_;
  std::map<AnchorId, AnchorPlacement> placements_;
  std::map<MapId, std::set<AnchorId>> waiting_;  // for a keyframe of this map
  GroupStates<PosedGroup> groups_;
  std::map<MapId, Correction> corrections_;
  std::vector<std::string> not_placed_;
  // Since the last change; nothing: to be computed.
  mutable std::optional<std::map<AnchorId, InGroup>> positions_;
};

}  // namespace pangea
