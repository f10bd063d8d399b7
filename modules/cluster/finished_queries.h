#pragma once

// The queries that have all their results, but whose match is still in the queue: if NATS is killed
// at the wrong moment, an acknowledged match stays there for ever. Not thread safe.
//
// Bounded: a query whose match has left the queue is forgotten, because nobody waits for it any
// more. Beyond kMaxQueries the one with the lowest id is forgotten. It is only looked up again, and
// a match that waits for it meanwhile goes back into the queue.

#include <set>
#include <vector>

#include "core/ids.h"

namespace pangea {

class FinishedQueries {
 public:
  static constexpr size_t kMaxQueries = 10'000;

  void Add(const KeyframeId& query);
  // `pending`: the queries of the map whose match is in the queue now. Removes the finished ones.
  void RemoveFrom(const MapId& map, std::vector<KeyframeId>* pending);

  size_t size() const { return queries_.size(); }

 private:
  std::set<KeyframeId> queries_;
};

}  // namespace pangea
