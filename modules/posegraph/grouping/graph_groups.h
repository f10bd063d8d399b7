#pragma once

// Which maps are one group. A group is named by its oldest map; a new map is one by itself.

#include <map>
#include <vector>

#include "core/byte_record.h"
#include "posegraph/grouping/graph_group.h"
#include "posegraph/grouping/map_pairs.h"

namespace pangea {

class GraphGroups {
 public:
  // A group by itself, with the next number.
  void AddMap();
  // By the merges as they are now. A group of the same maps as before stays as it was.
  void Regroup(const MapPairs& pairs);

  GraphGroup& Of(int map) { return groups_.at(oldest_[map]); }
  bool AreOne(int map, int other) const { return oldest_[map] == oldest_[other]; }

  size_t num_maps() const { return oldest_.size(); }
  // By their oldest maps.
  std::map<int, GraphGroup>& by_oldest() { return groups_; }
  const std::map<int, GraphGroup>& by_oldest() const { return groups_; }

  void Save(ByteWriter* writer) const;
  // Into an empty one; false if these are not the bytes of groups of so many maps.
  bool Restore(ByteReader* reader, size_t num_maps);

 private:
  std::map<int, GraphGroup> groups_;
  std::vector<int> oldest_;  // of the group of each map
};

}  // namespace pangea
