#include "posegraph/graph/map_tags.h"

#include <algorithm>

namespace pangea {
namespace {

void Put(const TagId& tag, ByteWriter* writer) {
  writer->Put(tag.family);
  writer->Put(tag.id);
}

void Get(ByteReader* reader, TagId* tag) {
  reader->Get(&tag->family);
  reader->Get(&tag->id);
}

}  // namespace

void MapTags::Add(int node, const Keyframe& keyframe) {
  constexpr int kVisit = 20;  // keyframes without the tag end a visit
  const Rigid3 T_odom_cam = keyframe.T_odom_cam();
  for (const TagObservation& tag : keyframe.tags) {
    of_node_[node].push_back(tag.tag);
    const auto direction = DirectionTo(tag, keyframe.camera);
    const auto [known, is_new] = seen_.try_emplace(tag.tag, Seen{{}, node});
    Seen& seen = known->second;
    if (direction && node - seen.node < kVisit) {
      seen.rays.Add(T_odom_cam.t, T_odom_cam.q * *direction);
      seen.node = node;
    }
  }
  if (const auto added = of_node_.find(node); added != of_node_.end()) {
    std::ranges::sort(added->second);
  }
}

std::optional<TagId> MapTags::Common(const MapTags& a, int node_a, const MapTags& b, int node_b) {
  const auto of_a = a.of_node_.find(node_a), of_b = b.of_node_.find(node_b);
  if (of_a == a.of_node_.end() || of_b == b.of_node_.end()) {
    return std::nullopt;
  }
  const auto common = std::ranges::find_if(of_a->second, [&](const TagId& tag) {
    return std::ranges::binary_search(of_b->second, tag);
  });
  return common == of_a->second.end() ? std::nullopt : std::optional(*common);
}

void MapTags::Save(ByteWriter* writer) const {
  writer->PutCount(of_node_.size());
  for (const auto& [node, tags] : of_node_) {
    writer->Put(node);
    writer->PutCount(tags.size());
    for (const TagId& tag : tags) {
      Put(tag, writer);
    }
  }
  writer->PutCount(seen_.size());
  for (const auto& [tag, seen] : seen_) {
    Put(tag, writer);
    writer->Put(seen.node);
    seen.rays.Visit([writer](const auto& part) { writer->Put(part); });
  }
}

void MapTags::Restore(ByteReader* reader) {
  for (size_t left = reader->GetCount(1); left > 0; --left) {
    int node = 0;
    reader->Get(&node);
    std::vector<TagId>& tags = of_node_[node];
    tags.resize(reader->GetCount(1));
    for (TagId& tag : tags) {
      Get(reader, &tag);
    }
  }
  for (size_t left = reader->GetCount(1); left > 0; --left) {
    TagId tag;
    Get(reader, &tag);
    Seen& seen = seen_[tag];
    reader->Get(&seen.node);
    seen.rays.Visit([reader](auto& part) { reader->Get(&part); });
  }
}

}  // namespace pangea
