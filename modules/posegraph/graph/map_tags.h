#pragma once

// The AprilTags that one map's keyframes see, and where in its odom frame they are.

#include <map>
#include <optional>
#include <vector>

#include "core/byte_record.h"
#include "core/keyframe.h"
#include "core/tags/tag_place.h"

namespace pangea {

class MapTags {
 public:
  struct Seen {
    TagRays rays;  // of the first visit, during which odometry drifts little
    int node = 0;  // the last one of these
  };

  void Add(int node, const Keyframe& keyframe);

  // By tag.
  const std::map<TagId, Seen>& seen() const { return seen_; }
  // A tag that both nodes see, the one with the lowest id.
  static std::optional<TagId> Common(const MapTags& a, int node_a, const MapTags& b, int node_b);

  void Save(ByteWriter* writer) const;
  void Restore(ByteReader* reader);

 private:
  std::map<int, std::vector<TagId>> of_node_;  // ascending ids
  std::map<TagId, Seen> seen_;
};

}  // namespace pangea
