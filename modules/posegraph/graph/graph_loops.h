#pragma once

// The loops of the pose graph, in the order in which they came: within maps and between them,
// whether or not these are one group.

#include <deque>
#include <vector>

#include "core/byte_record.h"
#include "core/server_messages.h"
#include "posegraph/graph/graph_maps.h"
#include "posegraph/loop.h"

namespace pangea {

// An accepted constraint between two nodes.
Loop MakeLoop(const Constraint& constraint, NodeRef from, NodeRef to, const GraphMaps& maps);

class GraphLoops {
 public:
  const Loop& Add(const Loop& loop);

  size_t size() const { return loops_.size(); }
  auto begin() const { return loops_.begin(); }
  auto end() const { return loops_.end(); }

  // Those with both ends in these maps (ascending), in the order they came.
  std::vector<const Loop*> Among(const std::vector<int>& maps) const;
  std::vector<Loop*> Among(const std::vector<int>& maps);

  void Save(ByteWriter* writer) const;
  // Into an empty one; false if these are not the bytes of loops of these maps.
  bool Restore(ByteReader* reader, const GraphMaps& maps);

 private:
  void Index(int loop);
  std::vector<int> NumbersAmong(const std::vector<int>& maps) const;

  std::deque<Loop> loops_;
  std::vector<std::vector<int>> from_;  // of each map: indices of the loops that begin in it
};

}  // namespace pangea
