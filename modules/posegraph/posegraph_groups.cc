// Which maps are one group, and what is in it. None of this looks at loops of other groups.

#include <algorithm>
#include <numeric>

#include "posegraph/posegraph.h"

namespace pangea {
namespace {

// A merge needs this many loops that the robust solve keeps.
constexpr int kMinLoopsInForce = 2;

}  // namespace

void PoseGraph::Regroup() {
  std::vector<int> root(maps_.size());
  std::iota(root.begin(), root.end(), 0);
  const auto find = [&](int map) {
    while (root[map] != map) {
      map = root[map];
    }
    return map;
  };
  for (const auto& entry : pairs_) {
    if (IsMerged(entry)) {
      const auto& [a, b] = entry.first;
      const auto [older, newer] = std::minmax({find(a), find(b)});
      root[newer] = older;
    }
  }
  std::map<int, Group> groups;
  for (int map = 0; map < static_cast<int>(maps_.size()); ++map) {
    group_of_[map] = find(map);
    groups[group_of_[map]].maps.push_back(map);
  }
  for (auto& [oldest, group] : groups) {
    const auto before = groups_.find(oldest);
    if (before != groups_.end() && before->second.maps == group.maps) {
      group = before->second;
    } else {
      group.stale = group.publish_now = true;
      group.whole_loops = before == groups_.end() ? 0 : before->second.whole_loops;
    }
  }
  groups_ = std::move(groups);
}

std::vector<int> PoseGraph::LoopNumbersOf(const Group& group) const {
  std::vector<int> numbers;
  for (const int map : group.maps) {
    for (const int loop : maps_[map].loops_from) {
      if (group_of_[loops_[loop].to.map] == group.maps.front()) {
        numbers.push_back(loop);
      }
    }
  }
  std::ranges::sort(numbers);
  return numbers;
}

std::vector<Loop*> PoseGraph::LoopsOf(const Group& group) {
  std::vector<Loop*> loops;
  for (const int loop : LoopNumbersOf(group)) {
    loops.push_back(&loops_[loop]);
  }
  return loops;
}

std::vector<const PoseGraph::PairEntry*> PoseGraph::PairsOf(const Group& group) const {
  std::vector<const PairEntry*> pairs;
  for (const int map : group.maps) {
    for (auto pair = pairs_.lower_bound({map, 0}); pair != pairs_.end() && pair->first.first == map;
         ++pair) {
      pairs.push_back(&*pair);
    }
  }
  return pairs;
}

size_t PoseGraph::NumKeyframes(const Group& group) const {
  size_t count = 0;
  for (const int map : group.maps) {
    count += maps_[map].chain.size();
  }
  return count;
}

bool PoseGraph::UndoMerges(const Group& group) {
  std::map<Pair, int> in_force;
  for (const Loop* loop : LoopsOf(group)) {
    const auto [a, b] = std::minmax(loop->from.map, loop->to.map);
    const int weight = loop->derived ? kMinLoopsInForce : 1;
    in_force[{a, b}] += loop->on ? weight : 0;
  }
  bool any = false;
  for (const PairEntry* entry : PairsOf(group)) {
    const auto [a, b] = std::minmax(entry->first.first, entry->first.second);
    if (group_of_[a] == group_of_[b] && IsMerged(*entry) && in_force[{a, b}] < kMinLoopsInForce) {
      undone_.insert(entry->first);
      any = true;
    }
  }
  return any;
}

}  // namespace pangea
