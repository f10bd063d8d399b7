#include "global_ba/matched_pairs.h"

namespace pangea {

std::vector<KeyframePair> MatchedPairs::OfMap(const MapId& map) const {
  std::vector<KeyframePair> pairs;
  for (auto pair = by_query_.lower_bound({{map, 0}, {}});
       pair != by_query_.end() && pair->first.map == map; ++pair) {
    pairs.push_back(*pair);
  }
  return pairs;
}

std::vector<KeyframePair> MatchedPairs::OfQuery(const KeyframeId& query) const {
  std::vector<KeyframePair> pairs;
  for (auto pair = by_query_.lower_bound({query, {}});
       pair != by_query_.end() && pair->first == query; ++pair) {
    pairs.push_back(*pair);
  }
  return pairs;
}

std::vector<KeyframeId> MatchedPairs::PartnersOf(const KeyframeId& id) const {
  std::vector<KeyframeId> partners;
  for (const std::set<KeyframePair>* pairs : {&by_query_, &by_match_}) {
    for (auto pair = pairs->lower_bound({id, {}}); pair != pairs->end() && pair->first == id;
         ++pair) {
      partners.push_back(pair->second);
    }
  }
  return partners;
}

}  // namespace pangea
