#include "posegraph/graph/graph_maps.h"

#include <algorithm>

#include "posegraph/solver/four_dof_record.h"

namespace pangea {

bool GraphMap::Add(const Keyframe& keyframe) {
  if (!chain.Add(keyframe)) {
    return false;
  }
  const int node = static_cast<int>(chain.size()) - 1;
  poses.push_back(PoseOf(node));
  tags.Add(node, keyframe);
  known_revision = std::max(known_revision, keyframe.group_revision);
  return true;
}

void GraphMap::PlaceByOdometry(int first) {
  for (size_t i = first; i < chain.size(); ++i) {
    poses[i] = PoseOf(static_cast<int>(i));
  }
}

void GraphMap::Move(const Pose4& T_map_before) {
  T_map_odom = T_map_before * T_map_odom;
  for (Pose4& pose : poses) {
    pose = T_map_before * pose;
  }
}

int GraphMaps::Add(const MapId& id) {
  const auto [it, is_new] = numbers_.try_emplace(id, static_cast<int>(maps_.size()));
  if (is_new) {
    GraphMap& map = maps_.emplace_back();
    map.id = id;
    map.solved_with = it->second;
  }
  return it->second;
}

std::optional<int> GraphMaps::Number(const MapId& id) const {
  const auto number = numbers_.find(id);
  return number == numbers_.end() ? std::nullopt : std::optional<int>(number->second);
}

std::optional<NodeRef> GraphMaps::Find(const KeyframeId& id) const {
  const std::optional<int> number = Number(id.map);
  const std::optional<int> node = number ? maps_[*number].chain.Find(id.seq) : std::nullopt;
  return node ? std::optional<NodeRef>({*number, *node}) : std::nullopt;
}

bool GraphMaps::Contains(const NodeRef& node) const {
  return node.map >= 0 && static_cast<size_t>(node.map) < maps_.size() && node.node >= 0 &&
         static_cast<size_t>(node.node) < maps_[node.map].chain.size();
}

void GraphMaps::Save(ByteWriter* writer) const {
  writer->PutCount(maps_.size());
  for (const GraphMap& map : maps_) {
    writer->Put(map.id);
    map.chain.Save(writer);
    map.tags.Save(writer);
    writer->PutCount(map.poses.size());
    for (const Pose4& pose : map.poses) {
      Put(pose, writer);
    }
    Put(map.T_map_odom, writer);
    writer->Put(map.log_scale);
    writer->Put(map.newest_solved);
    writer->Put(map.covariance);
    writer->Put(map.known_revision);
  }
}

bool GraphMaps::Restore(ByteReader* reader) {
  maps_.resize(reader->GetCount(1));
  int number = 0;
  for (GraphMap& map : maps_) {
    reader->Get(&map.id);
    numbers_.emplace(map.id, number++);
    const bool is_chain = map.chain.Restore(reader);
    map.tags.Restore(reader);
    map.poses.resize(reader->GetCount(1));
    for (Pose4& pose : map.poses) {
      Get(reader, &pose);
    }
    Get(reader, &map.T_map_odom);
    reader->Get(&map.log_scale);
    reader->Get(&map.newest_solved);
    reader->Get(&map.covariance);
    reader->Get(&map.known_revision);
    if (!is_chain || map.poses.size() != map.chain.size() ||
        map.newest_solved >= static_cast<int>(map.chain.size())) {
      return false;
    }
  }
  return true;
}

}  // namespace pangea
