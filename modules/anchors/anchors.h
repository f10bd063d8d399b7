#pragma once

// The anchors of all maps, and their poses for each agent.
//
// Input: keyframes (in the order of each map), edits (in the journal's order), complete group
// states, corrections. Output: for an agent, the anchors of its group near it, in its odom frame;
// for other receivers, all anchors in their group's frame. An anchor is attached to keyframes
// (placement.h), so it moves with them when the pose graph or a bundle adjustment moves them, when
// maps are fused, and when a fusion is undone.
//
// No clock, no thread: the same calls give the same results. Memory: max_anchors anchors, and the
// data of each keyframe in odometry_track.h.

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
  double near_m = 50;  // largest distance from an agent
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
  // Returns the reason of a refusal, or an empty string.
  std::string Take(const AnchorEdit& edit);
  // A complete state (not a chunk). For each map the state with the highest revision counts.
  void Take(const MapState& state);
  void Take(const Correction& correction);

  // Maps that have had no new keyframe since the last call count as ended: anchors that wait there
  // are placed by the keyframes before them.
  void PlaceInEndedMaps();

  // The map that an agent's odometry is in, as its poses say. Map ids do not: the agent's clock may
  // have been set back.
  void SetCurrentMap(const MapId& map) { current_maps_[map.agent_id] = map; }

  // The current map of each agent, or, if that has no keyframes yet, the one with the highest id.
  std::vector<MapId> AgentMaps() const;
  // The anchors near the map's newest keyframe, nearest first; then those that are gone for it:
  // deleted ones (the newest max_near), and all others in `told`, which are deleted, not near any
  // more, or no longer in its group. Empty for a map without keyframes.
  std::vector<AnchorState> ForAgent(const MapId& map, const std::set<AnchorId>& told = {}) const;
  // Every anchor with a place, in its group's frame; deleted ones too (AnchorState::gone).
  std::vector<AnchorState> All() const;

  // The merged edits, also of anchors without a place.
  const AnchorRegistry& registry() const { return registry_; }
  // An anchor in its group's frame; empty if it has no place.
  std::optional<AnchorState> InItsGroup(const AnchorId& id) const;
  // The group of a map, and its revision; the map itself and 0 if no state has the map.
  std::pair<MapId, int64_t> GroupAndRevision(const MapId& map) const;
  // Whether it is the id of a group, or of a map that is alone.
  bool HasGroup(const MapId& group) const;
  // Pose of the odom frame in the group's frame, at the newest keyframe; identity for a map without
  // a group.
  Rigid3 T_map_odom(const MapId& map) const;
  // Extrinsics of a map's newest keyframe; empty for a map without keyframes.
  std::optional<Rigid3> T_body_cam(const MapId& map) const;
  // The group's keyframe nearest to a point in its frame (metres); empty if `group` is not, or no
  // longer, the id of a group with keyframes.
  struct NearKeyframe {
    KeyframeId id;
    Rigid3 T_map_body;
  };
  std::optional<NearKeyframe> NearestKeyframe(const MapId& group,
                                              const Eigen::Vector3d& p_map) const;
  // Null for a map without keyframes.
  const TrackedKeyframe* NewestKeyframe(const MapId& map) const;
  // The placement that an edit would have, with the present maps.
  PlacementResult Try(const AnchorEdit& edit, bool ended = false) const;
  // Corrects a pose relative to a keyframe, so that the anchor comes out where this keyframe has it
  // with the present maps. Changes nothing if the edit has no such pose, or the keyframe is
  // missing.
  void MakeExact(AnchorEdit* edit) const;

  size_t num_anchors() const { return registry_.entries().size() - registry_.num_deleted(); }
  size_t num_placed() const;
  RecordCounters store_counters() const;
  const RecordStore* records() const { return records_.get(); }
  // Anchors that wait for a keyframe, for their place or a newer one.
  size_t num_waiting() const;
  // Reasons why anchors could not be placed, since the last call.
  std::vector<std::string> TakeNotPlaced() { return std::exchange(not_placed_, {}); }

 private:
  // A pose in the group's frame, with its covariance.
  struct InGroup {
    Rigid3 T_map_anchor;
    Matrix6d covariance;
  };

  // An anchor's edits, by (revision, agent).
  struct Tries {
    std::pair<int64_t, int32_t> placed{0, 0};
    std::set<std::pair<int64_t, int32_t>> failed;
  };

  // The anchor's pose in its group's frame with the placement of Try; empty if there is none.
  std::optional<Rigid3> TryInGroup(const AnchorEdit& edit) const;
  // `ended`: a map that is known to have ended.
  void PlaceOrWait(const AnchorId& id, const std::optional<MapId>& ended = std::nullopt);
  Rigid3 T_map_body(const MapId& map, int32_t seq) const;
  InGroup Position(const AnchorPlacement& placement) const;
  // The pose of each placed anchor.
  const std::map<AnchorId, InGroup>& Positions() const;
  bool SameGroup(const MapId& a, const MapId& b) const;
  // The anchor's state without its pose.
  AnchorState Describe(const AnchorId& id, const MapId& map) const;
  std::vector<AnchorId> DeletedOf(const MapId& map) const;
  std::vector<AnchorId> Near(const MapId& map, const Rigid3& T_odom_map,
                             const Eigen::Vector3d& p_odom_agent,
                             const std::set<AnchorId>& told) const;

  const AnchorsOptions options_;
  const std::shared_ptr<RecordStore> records_;
  AnchorRegistry registry_;
  std::map<MapId, OdometryTrack> tracks_;
  std::map<AnchorId, AnchorPlacement> placements_;
  std::map<AnchorId, Tries> tries_;
  std::map<MapId, std::set<AnchorId>> waiting_;  // by map: anchors that wait for a keyframe
  GroupStates<PosedGroup> groups_;
  std::map<MapId, Correction> corrections_;
  std::map<int32_t, MapId> current_maps_;  // by agent
  std::map<MapId, int32_t> newest_seqs_;   // at the last call of PlaceInEndedMaps
  std::vector<std::string> not_placed_;
  // Cache; empty after a change.
  mutable std::optional<std::map<AnchorId, InGroup>> positions_;
};

}  // namespace pangea
