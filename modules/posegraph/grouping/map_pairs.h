#pragma once

// The pairs of maps with loops between them: the evidence of each pair (pair_evidence.h), and
// whether it is merged. If the robust solve switches off the loops of a merge, the merge is undone
// until new evidence arrives. Maps that would have different tags at one place are not merged,
// however much evidence says so: they are look-alikes (grouping/different_tags.h).

#include <cstdint>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "core/byte_record.h"
#include "posegraph/graph/graph_maps.h"
#include "posegraph/loop.h"
#include "posegraph/pair_evidence.h"

namespace pangea {

struct MapPair {
  int a;  // map numbers; a is the map with the smaller id (not number)
  int b;
  PairEvidence evidence;
  bool undone = false;
  std::set<int64_t> contradicted;  // ids of candidates that tags contradict
  bool different_tags = false;     // the maps would have different tags at one place

  bool merged() const { return evidence.decision().merge && !undone && !different_tags; }
};

class MapPairs {
 public:
  explicit MapPairs(const MergeOptions& options) : options_(options) {}

  // Adds a loop between two maps. True if it merges or separates them.
  bool Add(const Loop& loop, const GraphMaps& maps);

  // Notes a candidate between two maps that was refused because of different tags at one place.
  // True if it separates the maps.
  bool NoteDifferentTags(int map_a, int map_b, int64_t constraint_id, const GraphMaps& maps);

  // The pairs whose two maps are both in `maps` (ascending).
  std::vector<const MapPair*> Among(const std::vector<int>& maps) const;
  std::vector<const MapPair*> All() const;

  // Undoes the merges within `maps` (ascending) that have fewer than two loops in force (a
  // sufficient loop counts as two). True if there was any.
  bool UndoMerges(const std::vector<int>& maps, const std::vector<const Loop*>& loops);
  void RedoMerges();

  void Save(ByteWriter* writer) const;
  // Call on an empty object. False if the bytes are not those of pairs of `maps`.
  bool Restore(ByteReader* reader, const GraphMaps& maps);

 private:
  using Key = std::pair<int, int>;

  MapPair* FindOrAdd(const Key& key, const GraphMaps& maps);
  MapPair* PairOf(int map_a, int map_b, const GraphMaps& maps);

  MergeOptions options_;
  std::map<Key, MapPair> pairs_;
};

}  // namespace pangea
