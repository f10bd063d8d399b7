#include "posegraph/grouping/graph_groups.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace pangea {
namespace {

// The oldest map of each map's group: connected components of the merges.
std::vector<int> OldestOf(size_t num_maps, const MapPairs& pairs) {
  std::vector<int> root(num_maps);
  std::iota(root.begin(), root.end(), 0);
  const auto find = [&root](int map) {
    while (root[map] != map) {
      map = root[map];
    }
    return map;
  };
  for (const MapPair* pair : pairs.All()) {
    if (pair->merged()) {
      const auto [older, newer] = std::minmax({find(pair->a), find(pair->b)});
      root[newer] = older;
    }
  }
  for (int& oldest : root) {
    oldest = find(oldest);
  }
  return root;
}

}  // namespace

void GraphGroups::AddMap() {
  const auto number = static_cast<int>(oldest_.size());
  oldest_.push_back(number);
  groups_[number].maps = {number};
}

void GraphGroups::Regroup(const MapPairs& pairs) {
  oldest_ = OldestOf(oldest_.size(), pairs);
  std::map<int, GraphGroup> groups;
  for (int map = 0; map < static_cast<int>(oldest_.size()); ++map) {
    groups[oldest_[map]].maps.push_back(map);
  }
  for (auto& [oldest, group] : groups) {
    const auto before = groups_.find(oldest);
    if (before != groups_.end() && before->second.maps == group.maps) {
      group = before->second;
    } else {
      group.solve.stale = true;
      group.solve.whole_loops = before == groups_.end() ? 0 : before->second.solve.whole_loops;
      group.publication.Request();
    }
  }
  groups_ = std::move(groups);
}

void GraphGroups::Save(ByteWriter* writer) const {
  writer->PutCount(groups_.size());
  for (const auto& [oldest, group] : groups_) {
    group.Save(writer);
  }
}

bool GraphGroups::Restore(ByteReader* reader, size_t num_maps) {
  oldest_.resize(num_maps);
  size_t num_grouped = 0;
  for (size_t left = reader->GetCount(1); left > 0; --left) {
    GraphGroup group;
    group.Restore(reader);
    for (const int map : group.maps) {
      if (map < 0 || static_cast<size_t>(map) >= num_maps) {
        return false;
      }
      oldest_[map] = group.oldest();
    }
    num_grouped += group.maps.size();
    if (group.maps.empty() || !groups_.emplace(group.oldest(), group).second) {
      return false;
    }
  }
  return num_grouped == num_maps;
}

}  // namespace pangea
