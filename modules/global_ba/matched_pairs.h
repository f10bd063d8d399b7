#pragma once

// Pairs of keyframes whose matched corners connect their landmarks: accepted constraints, and
// candidates refused as redundant.

#include <set>
#include <utility>
#include <vector>

#include "core/ids.h"

namespace pangea {

using KeyframePair = std::pair<KeyframeId, KeyframeId>;  // (query, match)

class MatchedPairs {
 public:
  // False for a repeat.
  bool Insert(const KeyframePair& pair) {
    by_match_.emplace(pair.second, pair.first);
    return by_query_.insert(pair).second;
  }

  const std::set<KeyframePair>& all() const { return by_query_; }
  // Pairs whose query belongs to the map, ascending.
  std::vector<KeyframePair> OfMap(const MapId& map) const;
  // Pairs with this query, ascending.
  std::vector<KeyframePair> OfQuery(const KeyframeId& query) const;
  // The other keyframe of every pair with this keyframe.
  std::vector<KeyframeId> PartnersOf(const KeyframeId& id) const;

 private:
  std::set<KeyframePair> by_query_;
  std::set<KeyframePair> by_match_;  // (match, query)
};

}  // namespace pangea
