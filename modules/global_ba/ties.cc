#include "global_ba/ties.h"

namespace pangea {

std::vector<KeyframePair> Ties::OfMap(const MapId& map) const {
  std::vector<KeyframePair> pairs;
  for (auto pair = by_query_.lower_bound({{map, 0}, {}});
       pair != by_query_.end() && pair->first.map == map; ++pair) {
    pairs.push_back(*pair);
  }
  return pairs;
}

std::vector<KeyframePair> Ties::OfQuery(const KeyframeId& query) const {
  std::vector<KeyframePair> pairs;
  for (auto pair = by_query_.lower_bound({query, {}});
       pair != by_query_.end() && pair->first == query; ++pair) {
    pairs.push_back(*pair);
  }
  return pairs;
}

std::vector<KeyframeId> Ties::PartnersOf(const KeyframeId& id) const {
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
