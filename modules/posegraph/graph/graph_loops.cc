#include "posegraph/graph/graph_loops.h"

#include <algorithm>

#include "posegraph/solver/four_dof_record.h"

namespace pangea {
namespace {

constexpr TagId kNoTag{TagFamily::k36h11, -1};  // in records

void Put(const NodeRef& node, ByteWriter* writer) {
  writer->Put(node.map);
  writer->Put(node.node);
}

void Get(ByteReader* reader, NodeRef* node) {
  reader->Get(&node->map);
  reader->Get(&node->node);
}

}  // namespace

Loop MakeLoop(const Constraint& constraint, NodeRef from, NodeRef to, const GraphMaps& maps) {
  const OdometryChain::Node& node_from = maps[from.map].chain[from.node];
  const OdometryChain::Node& node_to = maps[to.map].chain[to.node];
  Loop loop;
  loop.id = constraint.Id();
  loop.from = from;
  loop.to = to;
  loop.num_inliers = constraint.num_inliers;
  if (constraint.kind == PlaceKind::kTag) {
    loop.tag = MapTags::Common(maps[from.map].tags, from.node, maps[to.map].tags, to.node);
  }
  loop.sufficient = constraint.kind == PlaceKind::kDerived || loop.tag.has_value();
  loop.relative =
      MakeRelative4(constraint.T_from_to, constraint.covariance, node_from.T_odom_body.q,
                    node_from.roll_pitch_covariance, node_to.T_odom_body.q);
  return loop;
}

const Loop& GraphLoops::Add(const Loop& loop) {
  loops_.push_back(loop);
  Index(static_cast<int>(loops_.size()) - 1);
  return loops_.back();
}

void GraphLoops::Index(int loop) {
  const auto map = static_cast<size_t>(loops_[loop].from.map);
  from_.resize(std::max(from_.size(), map + 1));
  from_[map].push_back(loop);
  if (loops_[loop].tag) {
    by_tags_.push_back(loop);
  }
}

std::vector<const Loop*> GraphLoops::ByTags() const {
  std::vector<const Loop*> loops;
  for (const int loop : by_tags_) {
    loops.push_back(&loops_[loop]);
  }
  return loops;
}

std::vector<int> GraphLoops::NumbersAmong(const std::vector<int>& maps) const {
  std::vector<int> numbers;
  for (const int map : maps) {
    if (static_cast<size_t>(map) >= from_.size()) {
      break;
    }
    std::ranges::copy_if(from_[map], std::back_inserter(numbers), [&](int loop) {
      return std::ranges::binary_search(maps, loops_[loop].to.map);
    });
  }
  std::ranges::sort(numbers);
  return numbers;
}

std::vector<const Loop*> GraphLoops::Among(const std::vector<int>& maps) const {
  std::vector<const Loop*> loops;
  for (const int loop : NumbersAmong(maps)) {
    loops.push_back(&loops_[loop]);
  }
  return loops;
}

std::vector<Loop*> GraphLoops::Among(const std::vector<int>& maps) {
  std::vector<Loop*> loops;
  for (const int loop : NumbersAmong(maps)) {
    loops.push_back(&loops_[loop]);
  }
  return loops;
}

void GraphLoops::Save(ByteWriter* writer) const {
  writer->PutCount(loops_.size());
  for (const Loop& loop : loops_) {
    writer->Put(loop.id);
    Put(loop.from, writer);
    Put(loop.to, writer);
    Put(loop.relative, writer);
    writer->Put(loop.num_inliers);
    writer->Put(loop.sufficient);
    const TagId tag = loop.tag.value_or(kNoTag);
    writer->Put(tag.family);
    writer->Put(tag.id);
    writer->Put(loop.on);
  }
}

bool GraphLoops::Restore(ByteReader* reader, const GraphMaps& maps) {
  for (size_t left = reader->GetCount(1); left > 0; --left) {
    Loop loop;
    reader->Get(&loop.id);
    Get(reader, &loop.from);
    Get(reader, &loop.to);
    Get(reader, &loop.relative);
    reader->Get(&loop.num_inliers);
    reader->Get(&loop.sufficient);
    TagId tag;
    reader->Get(&tag.family);
    reader->Get(&tag.id);
    loop.tag = tag == kNoTag ? std::nullopt : std::optional(tag);
    reader->Get(&loop.on);
    if (!maps.Contains(loop.from) || !maps.Contains(loop.to)) {
      return false;
    }
    Add(loop);
  }
  return true;
}

}  // namespace pangea
