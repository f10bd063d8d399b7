#pragma once

// Chooses landmarks of the fused map for an agent: those that it will probably see next.
//
// Input: keyframes, group states, refinements (groups after bundle adjustment), an agent's newest
// pose. Output: MapLandmarks, small enough for one Ethernet frame. A landmark is a track of any
// agent's odometry; its descriptor is from the keyframe with the view most similar to the agent's.
// Source keyframes must be bundle adjusted, and must not be recent ones of the agent's own map:
// keyframes placed by the pose graph alone add nothing to the correction, and recent ones add
// nothing to the agent's odometry (docs/decisions/live_pose.md). Poses are always those of the
// newest state.
//
// No clock, no thread; the same calls give the same bytes. Bounded: keyframes as in KeyframeStore,
// and the landmarks recently sent to each map.

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "core/group_states.h"
#include "core/keyframe_store.h"
#include "core/map_landmarks.h"
#include "core/server_messages.h"

namespace pangea {

// Limits for one message. A source is a keyframe from which landmarks come. A message fits into
// 1200 bytes (landmarks_t).
inline constexpr int kMaxMessageSources = 4;
inline constexpr int kMaxMessageLandmarks =
    (1200 - 154) / static_cast<int>(25 + sizeof(Descriptor));

// An agent's pose (POSE_k).
struct AgentPose {
  MapId map;
  Rigid3 T_map_body;  // as the agent shows it
  Eigen::Vector3d v_map_body = Eigen::Vector3d::Zero();
};

class MapPoints {
 public:
  // `records`: stores keyframes; null: they stay in memory.
  explicit MapPoints(std::shared_ptr<RecordStore> records = nullptr)
      : store_(kStore, std::move(records)) {}

  // The record of a keyframe, as it is stored in `records`.
  static std::vector<uint8_t> RecordOf(const Keyframe& keyframe) {
    return KeyframeStore::RecordOf(keyframe, kStore);
  }
  // Saves only the keyframes: the journal has no states and refinements. Restore returns false, and
  // changes nothing, if the bytes are not those of a MapPoints.
  void Save(ByteWriter* writer) const { store_.Save(writer); }
  bool Restore(ByteReader* reader) { return store_.Restore(reader); }

  void Take(Keyframe keyframe) { store_.Add(std::move(keyframe)); }
  // A complete state (not a chunk). For each map the state with the highest revision counts.
  void Take(const MapState& state);
  // May come before the keyframes.
  void TakeRefined(const MapState& refined);
  // Empty if the group has no landmark that the agent might see and that was not sent recently.
  std::optional<MapLandmarks> Choose(const AgentPose& agent);

  size_t num_keyframes() const { return store_.size(); }
  const RecordCounters& store_counters() const { return store_.counters(); }
  size_t num_refined() const { return refined_.size(); }

 private:
  static constexpr KeyframeStoreOptions kStore{.max_views = 512};

  // The agent's predicted view.
  struct Outlook {
    CameraModel camera;
    Rigid3 T_map_cam;
    int32_t newest_seq = 0;
    DescriptorKind descriptor_kind = DescriptorKind::kOrb;
  };
  struct Source {
    KeyframeId id;
    Rigid3 T_map_cam;
    std::vector<std::pair<int, Eigen::Vector2d>> points;  // (corner, predicted pixel)
  };
  using Track = std::pair<MapId, int32_t>;
  struct Sent {
    int64_t message = 0;
    Eigen::Vector3d p_map = Eigen::Vector3d::Zero();
  };
  struct SentPoints {
    int64_t messages = 0;
    std::map<Track, Sent> tracks;
  };
  class Selection;

  std::optional<Outlook> OutlookOf(const AgentPose& agent, const PosedGroup& group);
  // The adjusted keyframes around the agent that look where it does and are not recent ones of its
  // own map, ascending. At most a bounded number, the nearest: each has to be read and projected.
  std::vector<KeyframeId> Near(const AgentPose& agent, const PosedGroup& group,
                               const Outlook& outlook);
  // In the body frame; null if it is not known.
  const Eigen::Vector3d* CameraAxisOf(const KeyframeId& id);
  std::vector<Source> SourcesFor(const AgentPose& agent, const PosedGroup& group,
                                 const Outlook& outlook);
  Source Look(const KeyframeView& view, const Rigid3& T_map_cam, const Outlook& outlook) const;

  KeyframeStore store_;
  GroupStates<PosedGroup> groups_;
  std::set<KeyframeId> refined_;
  std::map<MapId, SentPoints> sent_points_;
  std::map<MapId, Eigen::Vector3d> camera_axes_;
};

}  // namespace pangea
