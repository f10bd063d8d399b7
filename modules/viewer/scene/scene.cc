#include "viewer/scene/scene.h"

#include <algorithm>

namespace pangea::viewer {
namespace {

// If an optimisation moves a keyframe by less than both values, pages are not told.
constexpr double kMinMove_m = 5e-4;
constexpr double kMinRotation_rad = 5e-4;

bool Moved(const Rigid3& from, const Rigid3& to) {
  return (from.t - to.t).norm() > kMinMove_m || from.q.angularDistance(to.q) > kMinRotation_rad;
}

// The index of `key`. A new key is added by `append` if there are fewer than `limit`; else -1.
template <typename Key, typename Append>
int IndexOf(std::map<Key, int>* index, const Key& key, size_t limit, const Append& append) {
  const auto known = index->find(key);
  if (known != index->end()) {
    return known->second;
  }
  if (index->size() >= limit) {
    return -1;
  }
  const int next = static_cast<int>(index->size());
  index->emplace(key, next);
  append();
  return next;
}

}  // namespace

bool ShowsMore(const AnchorState& before, const AnchorState& after) {
  return before.revision != after.revision || before.edited_by != after.edited_by ||
         before.gone != after.gone || before.map != after.map ||
         Moved(before.T_odom_anchor, after.T_odom_anchor) || before.covariance != after.covariance;
}

std::optional<int> Scene::MapIndex(const MapId& id) const {
  const auto found = map_index_.find(id);
  return found == map_index_.end() ? std::nullopt : std::make_optional(found->second);
}

int Scene::MapOf(const MapId& id) {
  const int map = IndexOf(&map_index_, id, kMaxMaps, [&] {
    SceneMap added;
    added.id = id;
    added.group = id;
    changes_.Touch({ItemKind::kMap, static_cast<int64_t>(maps_.size())});
    maps_.push_back(std::move(added));
  });
  num_left_out_ += map < 0 ? 1 : 0;
  return map;
}

int Scene::KeyframeOf(const KeyframeId& id) {
  const int map = MapOf(id.map);
  if (map < 0) {
    return -1;
  }
  const int keyframe = IndexOf(&keyframe_index_, id, kMaxKeyframes, [&] {
    SceneKeyframe added;
    added.shown.id = id;
    added.map = map;
    keyframes_.push_back(std::move(added));
  });
  num_left_out_ += keyframe < 0 ? 1 : 0;
  return keyframe;
}

SceneAgent* Scene::AgentOf(int32_t id) {
  if (agents_.size() >= kMaxAgents && !agents_.contains(id)) {
    ++num_left_out_;
    return nullptr;
  }
  SceneAgent& agent = agents_[id];
  agent.id = id;
  agent.heard_s = time_s_;
  changes_.Touch({ItemKind::kAgent, id});
  return &agent;
}

void Scene::WorksIn(SceneAgent& agent, int map, const Rigid3& T_odom_body) {
  const bool newer = agent.map < 0 || maps_[static_cast<size_t>(map)].id.opened_utime >=
                                          maps_[static_cast<size_t>(agent.map)].id.opened_utime;
  if (newer) {
    agent.map = map;
    agent.T_odom_body = T_odom_body;
  }
}

// Each landmark is drawn once, at the keyframe that had it first. Drawn for each keyframe that saw
// it, it would be smeared along the viewing rays.
void Scene::AddPoints(SceneKeyframe& keyframe) {
  std::vector<ShownPoint>& points = keyframe.shown.points;
  std::unordered_set<int32_t>& landmarks = maps_[static_cast<size_t>(keyframe.map)].landmarks;
  std::erase_if(points, [&landmarks](const ShownPoint& point) {
    return point.landmark_id != kNoLandmark && !landmarks.insert(point.landmark_id).second;
  });
  if (num_points_ + points.size() > kMaxPoints) {
    points.clear();
    ++num_left_out_;
  }
  num_points_ += points.size();
}

void Scene::Take(const ShownKeyframe& keyframe) {
  const int index = KeyframeOf(keyframe.id);
  if (index < 0 || keyframes_[static_cast<size_t>(index)].arrived) {
    return;
  }
  SceneKeyframe& known = keyframes_[static_cast<size_t>(index)];
  known.arrived = true;
  known.shown = keyframe;
  known.shown.corners = {};
  AddPoints(known);
  ++maps_[static_cast<size_t>(known.map)].num_keyframes;
  changes_.Touch({ItemKind::kKeyframe, index});

  SceneAgent* agent = AgentOf(keyframe.id.map.agent_id);
  if (agent != nullptr) {
    agent->T_body_cam = keyframe.T_body_cam;
    agent->view = keyframe.view;
    agent->camera.Take(keyframe.corners);
    if (!agent->pose || agent->pose->map != keyframe.id.map) {
      WorksIn(*agent, known.map, keyframe.T_odom_body);
    }
  }
}

void Scene::Take(const ShownPose& pose) {
  SceneAgent* agent = AgentOf(pose.agent_id);
  if (agent == nullptr) {
    return;
  }
  const int map = pose.map ? MapOf(*pose.map) : -1;
  if (map >= 0) {
    WorksIn(*agent, map, pose.T_odom_body);
  }
  agent->pose = pose;
}

void Scene::Take(const std::shared_ptr<const ShownImage>& image) {
  SceneAgent* agent = AgentOf(image->agent_id);
  if (agent != nullptr) {
    agent->camera.Take(image);
  }
}

void Scene::Take(const Constraint& constraint) {
  if (MapOf(constraint.from.map) < 0 || MapOf(constraint.to.map) < 0) {
    return;
  }
  const int index = IndexOf(&constraint_index_, constraint.Id(), kMaxConstraints,
                            [&] { constraints_.push_back(constraint); });
  if (index < 0) {
    ++num_left_out_;
    return;
  }
  constraints_[static_cast<size_t>(index)] = constraint;
  changes_.Touch({ItemKind::kConstraint, index});
}

void Scene::Take(const Correction& correction) {
  const int map = MapOf(correction.map);
  if (map < 0 || !maps_[static_cast<size_t>(map)].drift.Take(correction)) {
    return;
  }
  JoinGroup(correction.map, correction.group, correction.revision);
  maps_[static_cast<size_t>(map)].T_map_odom = correction.T_map_odom;
  changes_.Touch({ItemKind::kMap, map});
  AgentOf(correction.map.agent_id);
}

void Scene::Take(const MapState& state) {
  for (const MapId& map : state.maps) {
    JoinGroup(map, state.group, state.revision);
  }
  for (const KeyframePose& pose : state.keyframes) {
    Place(pose, state);
  }
  NoteGroups(state);
}

void Scene::Place(const KeyframePose& pose, const MapState& state) {
  const int index = KeyframeOf(pose.id);
  if (index < 0) {
    return;
  }
  SceneKeyframe& keyframe = keyframes_[static_cast<size_t>(index)];
  if (keyframe.T_map_body && keyframe.revision >= state.revision) {
    return;
  }
  keyframe.revision = state.revision;
  if (!keyframe.T_map_body || keyframe.group != state.group ||
      Moved(*keyframe.T_map_body, pose.T_map_body)) {
    keyframe.T_map_body = pose.T_map_body;
    keyframe.group = state.group;
    changes_.Touch({ItemKind::kSolved, index});
  }
}

void Scene::JoinGroup(const MapId& map, const MapId& group, int64_t revision) {
  const int index = MapOf(map);
  if (index < 0 || MapOf(group) < 0) {
    return;
  }
  SceneMap& joining = maps_[static_cast<size_t>(index)];
  if (revision < joining.revision) {
    return;
  }
  joining.revision = revision;
  if (joining.group != group) {
    joining.group = group;
    changes_.Touch({ItemKind::kMap, index});
  }
}

void Scene::NoteGroups(const MapState& state) {
  GroupMaps group{state.revision, state.maps};
  std::ranges::sort(group.maps);
  const Regrouping regrouping = groups_.RegroupedBy(group);
  if ((regrouping.fused || regrouping.split) && fusions_.size() < kMaxFusions) {
    changes_.Touch({ItemKind::kFusion, static_cast<int64_t>(fusions_.size())});
    fusions_.push_back({time_s_, regrouping.fused, group.maps});
  }
  groups_.Take(std::move(group));
}

void Scene::Take(const ProcessHealth& health) {
  const int index =
      IndexOf(&process_index_, health.process, kMaxProcesses, [&] { processes_.emplace_back(); });
  if (index < 0) {
    ++num_left_out_;
    return;
  }
  processes_[static_cast<size_t>(index)] = {health, time_s_};
  changes_.Touch({ItemKind::kProcess, index});
}

void Scene::Take(const AnchorState& anchor) {
  // An anchor that is gone before it was ever shown is not added.
  if ((anchor.gone && !anchor_index_.contains(anchor.anchor)) || MapOf(anchor.map) < 0) {
    return;
  }
  const int index = IndexOf(&anchor_index_, anchor.anchor, kMaxAnchors, [&] {
    anchors_.push_back(anchor);
    changes_.Touch({ItemKind::kAnchor, static_cast<int64_t>(anchors_.size()) - 1});
  });
  if (index < 0) {
    ++num_left_out_;
    return;
  }
  AnchorState& known = anchors_[static_cast<size_t>(index)];
  const bool late = known.gone || anchor.revision < known.revision ||
                    (anchor.group == known.group && anchor.group_revision < known.group_revision);
  if (!late && ShowsMore(known, anchor)) {
    known = anchor;
    changes_.Touch({ItemKind::kAnchor, index});
  }
}

const AnchorState* Scene::FindAnchor(const AnchorId& id) const {
  const auto found = anchor_index_.find(id);
  if (found == anchor_index_.end() || anchors_[static_cast<size_t>(found->second)].gone) {
    return nullptr;
  }
  return &anchors_[static_cast<size_t>(found->second)];
}

void Scene::Tell(const std::string& notice) {
  notice_ = {time_s_, notice};
  changes_.Touch({ItemKind::kNotice, 0});
}

Rigid3 Scene::T_map_body(const SceneKeyframe& keyframe) const {
  const SceneMap& map = maps_[static_cast<size_t>(keyframe.map)];
  return keyframe.T_map_body && keyframe.group == map.group
             ? *keyframe.T_map_body
             : map.T_map_odom * keyframe.shown.T_odom_body;
}

double Scene::DriftOf(const SceneAgent& agent) const {
  return agent.map < 0 ? 0 : maps_[static_cast<size_t>(agent.map)].drift.Moved(agent.T_odom_body.t);
}

std::optional<Eigen::Matrix3d> Scene::PositionCovariance(const SceneAgent& agent) const {
  if (agent.map < 0 || !maps_[static_cast<size_t>(agent.map)].drift.newest()) {
    return std::nullopt;
  }
  const Correction& correction = *maps_[static_cast<size_t>(agent.map)].drift.newest();
  // p_map = T_map_odom p_odom; with xi = (dp, dtheta) in map, d p_map = dp - [R p_odom]x dtheta.
  Eigen::Matrix<double, 3, 6> J;
  J << Eigen::Matrix3d::Identity(), -Hat(correction.T_map_odom.q * agent.T_odom_body.t);
  return J * correction.covariance * J.transpose();
}

}  // namespace pangea::viewer
