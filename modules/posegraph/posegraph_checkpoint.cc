// A pose graph as bytes and back: all that it was given, and its solution.

#include <algorithm>
#include <utility>

#include "posegraph/posegraph.h"
#include "posegraph/solver/four_dof_record.h"

namespace pangea {
namespace {

void Put(const NodeRef& node, ByteWriter* writer) {
  writer->Put(node.map);
  writer->Put(node.node);
}

void Get(ByteReader* reader, NodeRef* node) {
  reader->Get(&node->map);
  reader->Get(&node->node);
}

void Put(const Loop& loop, ByteWriter* writer) {
  writer->Put(loop.id);
  Put(loop.from, writer);
  Put(loop.to, writer);
  Put(loop.relative, writer);
  writer->Put(loop.num_inliers);
  writer->Put(loop.derived);
  writer->Put(loop.on);
}

void Get(ByteReader* reader, Loop* loop) {
  reader->Get(&loop->id);
  Get(reader, &loop->from);
  Get(reader, &loop->to);
  Get(reader, &loop->relative);
  reader->Get(&loop->num_inliers);
  reader->Get(&loop->derived);
  reader->Get(&loop->on);
}

// What is looked at of one that is accepted.
void Put(const Constraint& constraint, ByteWriter* writer) {
  writer->Put(constraint.from);
  writer->Put(constraint.to);
  writer->Put(constraint.kind);
  writer->Put(constraint.T_from_to);
  writer->Put(constraint.covariance);
  writer->Put(constraint.num_inliers);
}

void Get(ByteReader* reader, Constraint* constraint) {
  reader->Get(&constraint->from);
  reader->Get(&constraint->to);
  reader->Get(&constraint->kind);
  reader->Get(&constraint->T_from_to);
  reader->Get(&constraint->covariance);
  reader->Get(&constraint->num_inliers);
  constraint->accepted = true;
}

template <typename Values>
void PutAll(const Values& values, ByteWriter* writer) {
  writer->PutCount(values.size());
  for (const auto& value : values) {
    Put(value, writer);
  }
}

template <typename Values>
void GetAll(ByteReader* reader, Values* values) {
  values->resize(reader->GetCount(1));
  for (auto& value : *values) {
    Get(reader, &value);
  }
}

bool IsIn(const NodeRef& node, const std::vector<size_t>& sizes) {
  return node.map >= 0 && static_cast<size_t>(node.map) < sizes.size() && node.node >= 0 &&
         static_cast<size_t>(node.node) < sizes[static_cast<size_t>(node.map)];
}

}  // namespace

void PoseGraph::Save(ByteWriter* writer) {
  SolveDue(false);
  writer->Put(num_solves_);
  writer->PutCount(maps_.size());
  for (const MapChain& map : maps_) {
    writer->Put(map.id);
    map.chain.Save(writer);
    PutAll(map.poses, writer);
    Put(map.T_map_odom, writer);
    writer->Put(map.log_scale);
    writer->Put(map.newest_solved);
    writer->Put(map.covariance);
  }
  PutAll(loops_, writer);
  writer->PutCount(pairs_.size());
  for (const auto& [pair, evidence] : pairs_) {
    writer->Put(pair.first);
    writer->Put(pair.second);
    writer->Put(undone_.contains(pair));
    evidence.Save(writer);
  }
  SaveGroups(writer);
  PutAll(parked_, writer);
  writer->Put(std::vector<int64_t>(seen_.begin(), seen_.end()));
}

void PoseGraph::SaveGroups(ByteWriter* writer) const {
  writer->PutCount(groups_.size());
  for (const auto& [oldest, group] : groups_) {
    writer->Put(group.maps);
    writer->Put(group.regrouped);
    writer->Put(group.stale);
    writer->Put(group.waiting_loops);
    writer->Put(group.keyframes_waiting);
    writer->Put(group.known_loops);
    writer->Put(group.whole_loops);
    writer->Put(std::vector<int>(group.changed.begin(), group.changed.end()));
    writer->Put(group.odometry_variance);
    writer->Put(group.unpublished);
    writer->Put(group.publish_now);
    writer->Put(group.keyframes_unpublished);
  }
}

bool PoseGraph::Restore(ByteReader* reader) {
  PoseGraph graph(options_, next_revision_);
  if (!graph.Read(reader)) {
    return false;
  }
  graph.solved_in_ = graph.group_of_;
  graph.restored_ = true;
  *this = std::move(graph);
  return true;
}

bool PoseGraph::Read(ByteReader* reader) {
  reader->Get(&num_solves_);
  maps_.resize(reader->GetCount(1));
  group_of_.resize(maps_.size());
  std::vector<size_t> sizes;
  for (MapChain& map : maps_) {
    reader->Get(&map.id);
    numbers_.emplace(map.id, static_cast<int>(sizes.size()));
    const bool is_chain = map.chain.Restore(reader);
    GetAll(reader, &map.poses);
    Get(reader, &map.T_map_odom);
    reader->Get(&map.log_scale);
    reader->Get(&map.newest_solved);
    reader->Get(&map.covariance);
    sizes.push_back(map.chain.size());
    if (!is_chain || map.poses.size() != map.chain.size() ||
        map.newest_solved >= static_cast<int>(map.chain.size())) {
      return false;
    }
  }
  GetAll(reader, &loops_);
  if (!std::ranges::all_of(loops_, [&](const Loop& loop) {
        return IsIn(loop.from, sizes) && IsIn(loop.to, sizes);
      })) {
    return false;
  }
  for (size_t i = 0; i < loops_.size(); ++i) {
    maps_[loops_[i].from.map].loops_from.push_back(static_cast<int>(i));
  }
  return ReadPairs(reader) && ReadGroups(reader) && ReadSeen(reader);
}

bool PoseGraph::ReadPairs(ByteReader* reader) {
  const auto count = static_cast<int>(maps_.size());
  for (size_t left = reader->GetCount(1); left > 0; --left) {
    Pair pair;
    bool undone = false;
    reader->Get(&pair.first);
    reader->Get(&pair.second);
    reader->Get(&undone);
    if (pair.first < 0 || pair.first >= count || pair.second < 0 || pair.second >= count) {
      return false;
    }
    const auto added =
        pairs_.try_emplace(pair, maps_[pair.first].chain, maps_[pair.second].chain, options_.merge);
    if (!added.second || !added.first->second.Restore(reader)) {
      return false;
    }
    if (undone) {
      undone_.insert(pair);
    }
  }
  return true;
}

bool PoseGraph::ReadGroups(ByteReader* reader) {
  size_t num_maps = 0;
  for (size_t left = reader->GetCount(1); left > 0; --left) {
    Group group;
    reader->Get(&group.maps);
    reader->Get(&group.regrouped);
    reader->Get(&group.stale);
    reader->Get(&group.waiting_loops);
    reader->Get(&group.keyframes_waiting);
    reader->Get(&group.known_loops);
    reader->Get(&group.whole_loops);
    std::vector<int> changed;
    reader->Get(&changed);
    group.changed = {changed.begin(), changed.end()};
    reader->Get(&group.odometry_variance);
    reader->Get(&group.unpublished);
    reader->Get(&group.publish_now);
    reader->Get(&group.keyframes_unpublished);
    for (const int map : group.maps) {
      if (map < 0 || map >= static_cast<int>(maps_.size())) {
        return false;
      }
      group_of_[map] = group.maps.front();
    }
    num_maps += group.maps.size();
    if (group.maps.empty() || !groups_.emplace(group.maps.front(), group).second) {
      return false;
    }
  }
  return num_maps == maps_.size();
}

bool PoseGraph::ReadSeen(ByteReader* reader) {
  GetAll(reader, &parked_);
  std::vector<int64_t> seen;
  reader->Get(&seen);
  seen_ = {seen.begin(), seen.end()};
  return reader->ok();
}

}  // namespace pangea
