#pragma once

// Chooses landmarks of a fused map for an agent: those it is likely to see next.
//
// In: keyframes, group states, refinements (groups after bundle adjustment), an agent's newest
// pose. Out: MapLandmarks, small enough for one Ethernet frame. A landmark is a track of some
// odometry; its descriptor is that of the keyframe that saw it most like the agent will. Only
// keyframes that were bundle adjusted are a source, and of the agent's own map only those it left
// long ago: what the pose graph alone has placed says less than the correction made of it, and of
// what the agent saw just now the map knows nothing that its odometry does not
// (docs/decisions/live_pose.md). Poses are always the newest state's.
//
// No clock, no thread; the same calls give the same bytes. Bounded: keyframes as SubmapStore, and
// what one agent was told lately.

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "core/group_states.h"
#include "core/map_landmarks.h"
#include "core/server_messages.h"
#include "core/submap_store.h"

namespace pangea {

// Of one message. A source is a keyframe they come from; together they fit 1200 bytes
// (landmarks_t).
inline constexpr int kMostSources = 4;
inline constexpr int kMostLandmarks = (1200 - 154) / static_cast<int>(25 + sizeof(Descriptor));

// What an agent says of itself (POSE_k).
struct AgentPose {
  MapId map;
  Rigid3 T_map_body;  // as it shows it
  Eigen::Vector3d v_map_body = Eigen::Vector3d::Zero();
};

class MapPoints {
 public:
  // `records`: for keyframes.
  explicit MapPoints(std::shared_ptr<RecordStore> records = nullptr)
      : store_(kStore, std::move(records)) {}

  // Its record of a keyframe.
  static std::vector<uint8_t> RecordOf(const Keyframe& keyframe) {
    return SubmapStore::RecordOf(keyframe, kStore);
  }
  // The keyframes. Restored: false, and nothing has changed, if these are not its bytes.
  void Save(ByteWriter* writer) const { store_.Save(writer); }
  bool Restore(ByteReader* reader) { return store_.Restore(reader) && reader->at_end(); }

  void Take(Keyframe keyframe) { store_.Add(std::move(keyframe)); }
  // Whole; the highest revision wins, map by map.
  void Take(const MapState& state);
  void TakeRefined(const MapState& refined);
  // Nothing when the group knows nothing new that the agent could see.
  std::optional<MapLandmarks> Choose(const AgentPose& agent);

  size_t num_keyframes() const { return store_.size(); }
  const RecordCounters& store_counters() const { return store_.counters(); }
  size_t num_refined() const { return refined_.size(); }

 private:
  static constexpr SubmapStoreOptions kStore{.max_views = 512};

  // Where the agent will be.
  struct Outlook {
    CameraModel camera;
    Rigid3 T_map_cam;
    int32_t newest_seq = 0;
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
  std::vector<Source> SourcesFor(const AgentPose& agent, const PosedGroup& group,
                                 const Outlook& outlook);
  Source Look(const KeyframeView& view, const Rigid3& T_map_cam, const Outlook& outlook) const;

  SubmapStore store_;
  GroupStates<PosedGroup> groups_;
  std::set<KeyframeId> refined_;
  std::map<MapId, SentPoints> sent_points_;
};

}  // namespace pangea
