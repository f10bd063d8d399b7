#pragma once

// The pairs of maps that have loops between them: their evidence (pair_evidence.h), and which of
// them are merged. A merge whose loops the robust solve switches off is undone until new evidence
// comes.

#include <map>
#include <utility>
#include <vector>

#include "core/byte_record.h"
#include "posegraph/graph/graph_maps.h"
#include "posegraph/loop.h"
#include "posegraph/pair_evidence.h"

namespace pangea {

struct MapPair {
  int a;  // numbers; a's id is the smaller one
  int b;
  PairEvidence evidence;
  bool undone = false;

  bool merged() const { return evidence.decision().merge && !undone; }
};

class MapPairs {
 public:
  explicit MapPairs(const MergeOptions& options) : options_(options) {}

  // A loop between two maps; true when it merges them or separates them.
  bool Add(const Loop& loop, const GraphMaps& maps);

  // Both of these maps (ascending).
  std::vector<const MapPair*> Among(const std::vector<int>& maps) const;
  std::vector<const MapPair*> All() const;

  // Undoes merges of these maps (ascending) that fewer than two of their loops in force carry;
  // whether there were any.
  bool UndoMerges(const std::vector<int>& maps, const std::vector<const Loop*>& loops);
  void RedoMerges();

  void Save(ByteWriter* writer) const;
  // Into an empty one; false if these are not the bytes of pairs of these maps.
  bool Restore(ByteReader* reader, const GraphMaps& maps);

 private:
  using Key = std::pair<int, int>;

  MapPair* FindOrAdd(const Key& key, const GraphMaps& maps);

  MergeOptions options_;
  std::map<Key, MapPair> pairs_;
};

}  // namespace pangea
