#pragma once

// All loops of the pose graph in order of arrival: within maps and between maps, whether or not the
// maps are in one group.

#include <deque>
#include <vector>

#include "core/byte_record.h"
#include "core/server_messages.h"
#include "posegraph/graph/graph_maps.h"
#include "posegraph/loop.h"

namespace pangea {

// Makes a loop of an accepted constraint between two known nodes.
Loop MakeLoop(const Constraint& constraint, NodeRef from, NodeRef to, const GraphMaps& maps);

class GraphLoops {
 public:
  const Loop& Add(const Loop& loop);

  size_t size() const { return loops_.size(); }
  auto begin() const { return loops_.begin(); }
  auto end() const { return loops_.end(); }

  // The loops with both ends in `maps` (ascending), in order of arrival.
  std::vector<const Loop*> Among(const std::vector<int>& maps) const;
  std::vector<Loop*> Among(const std::vector<int>& maps);

  // The loops by a tag, in order of arrival.
  std::vector<const Loop*> ByTags() const;

  void Save(ByteWriter* writer) const;
  // Call on an empty object. False if the bytes are not those of loops of `maps`.
  bool Restore(ByteReader* reader, const GraphMaps& maps);

 private:
  void Index(int loop);
  std::vector<int> NumbersAmong(const std::vector<int>& maps) const;

  std::deque<Loop> loops_;
  std::vector<std::vector<int>> from_;  // by map: indices of the loops that begin in it
  std::vector<int> by_tags_;            // indices of the loops by a tag
};

}  // namespace pangea
