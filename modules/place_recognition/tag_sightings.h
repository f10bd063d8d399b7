#pragma once

// Which keyframes saw which AprilTag. A keyframe that sees a tag that another map has seen, or its
// own map long ago, gets a candidate at once, whatever the images look like.
//
// Keyframes of one map come in ascending order. Deterministic; bounded.

#include <cstdint>
#include <map>
#include <vector>

#include "core/byte_record.h"
#include "core/ids.h"
#include "core/tags/tag.h"

namespace pangea {

class TagSightings {
 public:
  // `min_seq_gap`: a keyframe of its own map must be further away than this to be a candidate.
  explicit TagSightings(int32_t min_seq_gap) : min_seq_gap_(min_seq_gap) {}

  void Add(const KeyframeId& id, const std::vector<TagObservation>& tags);
  // The newest keyframe of each map that saw one of the tags, at most kMaxPlaces: of the newest
  // maps. Of the own map a newest one that is far enough.
  std::vector<KeyframeId> Places(const KeyframeId& query,
                                 const std::vector<TagObservation>& tags) const;

  void Save(ByteWriter* writer) const;
  void Restore(ByteReader* reader);

 private:
  static constexpr size_t kMaxPlaces = 4;
  static constexpr size_t kMaxKept = 16;       // of a map's keyframes that saw a tag
  static constexpr size_t kMaxLists = 50'000;  // of these

  // By map: the newest keyframe that saw the tag, and before it others with gaps; ascending.
  using Seqs = std::map<MapId, std::vector<int32_t>>;

  int32_t min_seq_gap_;
  std::map<TagId, Seqs> seqs_;
  size_t num_lists_ = 0;
};

}  // namespace pangea
