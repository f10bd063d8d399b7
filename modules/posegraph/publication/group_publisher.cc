#include "posegraph/publication/group_publisher.h"

#include <algorithm>
#include <utility>

namespace pangea {
namespace {

// The correction at the map's newest solved keyframe.
Correction CorrectionOf(const GraphMap& map, const RefinedMap& told) {
  const int newest = std::max(map.newest_solved, 0);
  const OdometryChain::Node& node = map.chain[newest];
  Correction correction;
  correction.map = map.id;
  correction.seq = node.seq;
  correction.T_map_odom = (told.Shift(newest) * map.RigidAt(newest)).ToRigid3();
  constexpr double kMinVariance = 1e-12;
  correction.covariance = kMinVariance * Matrix6d::Identity();
  correction.covariance.topLeftCorner<3, 3>() += map.covariance.topLeftCorner<3, 3>();
  correction.covariance.block<3, 1>(0, 5) += map.covariance.topRightCorner<3, 1>();
  correction.covariance.block<1, 3>(5, 0) += map.covariance.bottomLeftCorner<1, 3>();
  correction.covariance(5, 5) += map.covariance(3, 3);
  correction.covariance.block<2, 2>(3, 3) += node.roll_pitch_covariance;
  return correction;
}

}  // namespace

MapState GroupPublisher::StateOf(const GraphGroup& group, const GraphMaps& maps,
                                 const GraphLoops& loops,
                                 const std::map<int, RefinedMap>& told) const {
  MapState state;
  state.group = maps[group.oldest()].id;
  state.revision = next_revision_;
  for (const int number : group.maps) {
    const GraphMap& map = maps[number];
    state.maps.push_back(map.id);
    for (size_t i = 0; i < map.chain.size(); ++i) {
      const OdometryChain::Node& node = map.chain[i];
      state.keyframes.push_back(
          {{map.id, node.seq}, node.utime, told.at(number).T_map_body(static_cast<int>(i))});
    }
  }
  for (const Loop* loop : loops.Among(group.maps)) {
    ++(loop->on ? state.num_constraints : state.num_switched_off);
  }
  return state;
}

void GroupPublisher::PassRevision(int64_t earlier) {
  // Revisions begin at the wall clock (microseconds), so this is in the year 2112: only an agent
  // that lies names a higher one.
  constexpr int64_t kMaxCredible = int64_t{1} << 52;
  // The earlier run has published a few more that no keyframe names.
  constexpr int64_t kMargin = 1'000'000;
  if (earlier >= next_revision_ && earlier <= kMaxCredible) {
    next_revision_ = earlier + kMargin;
  }
}

MapState GroupPublisher::StateOf(const GraphGroup& group, const GraphMaps& maps,
                                 const GraphLoops& loops) const {
  return StateOf(group, maps, loops, refinements_.Refine(group.maps, maps));
}

void GroupPublisher::Publish(GraphGroup* group, const GraphMaps& maps, const GraphLoops& loops,
                             PoseGraphUpdate* update) {
  group->publication.Published();
  const std::map<int, RefinedMap> told = refinements_.Refine(group->maps, maps);
  MapState state = StateOf(*group, maps, loops, told);
  if (state.keyframes.empty()) {
    return;
  }
  ++next_revision_;
  for (const int number : group->maps) {
    const GraphMap& map = maps[number];
    const bool corrected = corrected_.contains(number) || map.known_revision > 0;
    if (map.newest_solved < 0 && !corrected) {
      continue;
    }
    corrected_.insert(number);
    Correction& correction = update->corrections.emplace_back(CorrectionOf(map, told.at(number)));
    correction.group = state.group;
    correction.revision = state.revision;
  }
  update->states.push_back(std::move(state));
}

}  // namespace pangea
