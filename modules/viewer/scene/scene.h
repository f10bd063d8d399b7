#pragma once

// Everything that is shown: maps, keyframes with their points, optimised poses, verification
// results, agents, the state of processes, fusions, anchors. In: domain messages in any order, with
// repeats. Out: the state, and the order in which it changed. Knows no page, socket or clock;
// SetTime gives the time. Not thread safe.
//
// Bounded (kMax...): what is beyond a bound is not shown, but counted.

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <unordered_set>
#include <utility>
#include <vector>

#include "core/anchor.h"
#include "core/drift.h"
#include "core/group_states.h"
#include "core/ids.h"
#include "core/keyframe.h"
#include "core/server_messages.h"
#include "viewer/scene/agent_view.h"
#include "viewer/scene/changes.h"

namespace pangea::viewer {

struct ShownPoint {
  Eigen::Vector3f p_body;  // metres
  int32_t landmark_id = kNoLandmark;
};

// The parts of a keyframe that are drawn.
struct ShownKeyframe {
  KeyframeId id;
  int64_t utime = 0;  // sensor clock
  Rigid3 T_odom_body;
  Rigid3 T_body_cam;
  // Edges of the image on the plane z = 1 of the camera frame: left, top, right, bottom.
  Eigen::Vector4d view = Eigen::Vector4d::Zero();
  std::vector<ShownPoint> points;
  ShownCorners corners;
};

struct ShownPose {
  int32_t agent_id = 0;
  int64_t utime = 0;
  std::string state;   // "tracking", "initialising", "lost"
  std::string reason;  // why it is not tracking
  int num_tracked = 0;
  std::optional<MapId> map;  // none while there is no pose
  Rigid3 T_odom_body;
};

struct ProcessHealth {
  std::string process;
  int64_t utime = 0;
  std::string summary;
  int64_t pending = 0;
  int64_t messages_in = 0;
  int64_t messages_out = 0;
  int64_t dropped = 0;
  int64_t resends_asked = 0;
  double median_ms = 0;
  double p99_ms = 0;
  double memory_mb = 0;
  double cpu_s = 0;
  std::vector<std::pair<std::string, int64_t>> refused;
};

struct SceneMap {
  MapId id;
  MapId group;           // its own id while it is not fused
  int64_t revision = 0;  // of the message that gave the group
  Rigid3 T_map_odom;     // for keyframes without an optimised pose
  int num_keyframes = 0;
  std::unordered_set<int32_t> landmarks;  // landmarks of the points that are drawn
  Drift drift;
};

struct SceneKeyframe {
  ShownKeyframe shown;
  // False if only the optimised pose has come. `shown` has only the points that no other keyframe
  // has.
  bool arrived = false;
  int map = 0;  // index into maps()
  // The optimised pose, in the odom frame of `group`.
  std::optional<Rigid3> T_map_body;
  MapId group;
  int64_t revision = 0;
};

struct SceneAgent {
  int32_t id = 0;
  int map = -1;  // index of the map it works in; -1: none yet
  std::optional<ShownPose> pose;
  Rigid3 T_odom_body;  // newest pose, or that of the newest keyframe if no poses are published
  Rigid3 T_body_cam;
  Eigen::Vector4d view = Eigen::Vector4d::Zero();
  AgentView camera;
  double heard_s = 0;
};

struct SceneProcess {
  ProcessHealth health;
  double heard_s = 0;
};

// Maps were fused into one group, or separated again.
struct Fusion {
  double time_s = 0;
  bool fused = true;
  std::vector<MapId> maps;
};

// A line of text for people; only the newest one is kept.
struct Notice {
  double time_s = 0;
  std::string text;
};

// Whether `after` differs visibly from `before`.
bool ShowsMore(const AnchorState& before, const AnchorState& after);

class Scene {
 public:
  static constexpr size_t kMaxAgents = 100;
  static constexpr size_t kMaxMaps = 500;
  static constexpr size_t kMaxKeyframes = 50'000;
  static constexpr size_t kMaxPoints = 3'000'000;
  static constexpr size_t kMaxConstraints = 50'000;
  static constexpr size_t kMaxProcesses = 200;
  static constexpr size_t kMaxFusions = 1000;
  static constexpr size_t kMaxAnchors = 10'000;  // including those that were deleted meanwhile

  // Seconds since the start of the show. The messages that follow count as of this time.
  void SetTime(double time_s) { time_s_ = time_s; }

  void Take(const ShownKeyframe& keyframe);
  void Take(const ShownPose& pose);
  void Take(const std::shared_ptr<const ShownImage>& image);
  void Take(const Constraint& constraint);
  void Take(const Correction& correction);
  void Take(const MapState& state);
  void Take(const ProcessHealth& health);
  // `anchor`: in its group's frame, as on channel ANCHOR. A deleted anchor stays in the list as
  // gone.
  void Take(const AnchorState& anchor);
  void Tell(const std::string& notice);

  double time_s() const { return time_s_; }
  const Changes& changes() const { return changes_; }
  const std::vector<SceneMap>& maps() const { return maps_; }
  const std::vector<SceneKeyframe>& keyframes() const { return keyframes_; }
  const std::vector<Constraint>& constraints() const { return constraints_; }
  const std::map<int32_t, SceneAgent>& agents() const { return agents_; }
  const std::vector<SceneProcess>& processes() const { return processes_; }
  const std::vector<Fusion>& fusions() const { return fusions_; }
  const std::vector<AnchorState>& anchors() const { return anchors_; }
  const AnchorState* FindAnchor(const AnchorId& id) const;  // null: unknown or gone
  const Notice& notice() const { return notice_; }
  std::optional<int> MapIndex(const MapId& id) const;
  int64_t num_left_out() const { return num_left_out_; }

  // The pose of a keyframe in its group's frame: optimised, or by its map's odometry.
  Rigid3 T_map_body(const SceneKeyframe& keyframe) const;

  // Metres by which corrections have moved the agent since its map joined its group.
  double DriftOf(const SceneAgent& agent) const;
  // Covariance of the agent's position in the map frame, m^2; nothing before its first correction.
  std::optional<Eigen::Matrix3d> PositionCovariance(const SceneAgent& agent) const;

 private:
  // Return an index; -1 if a bound is reached.
  int MapOf(const MapId& id);
  int KeyframeOf(const KeyframeId& id);
  SceneAgent* AgentOf(int32_t id);  // null if the bound is reached
  void AddPoints(SceneKeyframe& keyframe);
  void WorksIn(SceneAgent& agent, int map, const Rigid3& T_odom_body);
  void Place(const KeyframePose& pose, const MapState& state);
  void JoinGroup(const MapId& map, const MapId& group, int64_t revision);
  void NoteGroups(const MapState& state);

  double time_s_ = 0;
  Changes changes_;
  std::vector<SceneMap> maps_;
  std::map<MapId, int> map_index_;
  std::vector<SceneKeyframe> keyframes_;
  std::map<KeyframeId, int> keyframe_index_;
  size_t num_points_ = 0;
  std::vector<Constraint> constraints_;
  std::map<int64_t, int> constraint_index_;  // by Constraint::Id()
  std::map<int32_t, SceneAgent> agents_;
  std::vector<SceneProcess> processes_;
  std::map<std::string, int> process_index_;
  GroupStates<GroupMaps> groups_;
  std::vector<Fusion> fusions_;
  std::vector<AnchorState> anchors_;
  std::map<AnchorId, int> anchor_index_;
  Notice notice_;
  int64_t num_left_out_ = 0;
};

}  // namespace pangea::viewer
