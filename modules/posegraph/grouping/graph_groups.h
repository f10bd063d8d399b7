#pragma once

// The partition of the maps into groups. A group is named by its oldest map; a new map is a group
// of its own.

#include <map>
#include <vector>

#include "core/byte_record.h"
#include "posegraph/grouping/graph_group.h"
#include "posegraph/grouping/map_pairs.h"

namespace pangea {

class GraphGroups {
 public:
  // Adds a map, with the next number, as a group of its own.
  void AddMap();
  // Forms the groups from the present merges. A group whose set of maps is unchanged keeps its
  // state.
  void Regroup(const MapPairs& pairs);

  GraphGroup& Of(int map) { return groups_.at(oldest_[map]); }
  bool AreOne(int map, int other) const { return oldest_[map] == oldest_[other]; }

  size_t num_maps() const { return oldest_.size(); }
  // Keyed by the number of the group's oldest map.
  std::map<int, GraphGroup>& by_oldest() { return groups_; }
  const std::map<int, GraphGroup>& by_oldest() const { return groups_; }

  void Save(ByteWriter* writer) const;
  // Call on an empty object. False if the bytes are not those of groups of `num_maps` maps.
  bool Restore(ByteReader* reader, size_t num_maps);

 private:
  std::map<int, GraphGroup> groups_;
  std::vector<int> oldest_;  // by map: the oldest map of its group
};

}  // namespace pangea
