#include "agent_handler/journal/journal_index.h"

#include <algorithm>

#include "core/server_messages.h"

namespace pangea {

const JournalIndex::MapIndex* JournalIndex::FindMap(const MapId& id) const {
  const auto it = maps_.find(id);
  return it == maps_.end() ? nullptr : &it->second;
}

JournalIndex::Added JournalIndex::AddKeyframe(const KeyframeId& id, const JournalPlace& place) {
  MapIndex& map = maps_[id.map];
  if (!map.keyframes.emplace(id.seq, place).second) {
    return Added::kRepeat;
  }
  map.matched_below = std::min(map.matched_below, id.seq);  // it may fill a gap
  ++num_keyframes_;
  return Added::kNew;
}

JournalIndex::Added JournalIndex::Check(const PlaceMatch& match) const {
  const MapIndex* map = FindMap(match.query.map);
  if (map == nullptr || !map->keyframes.contains(match.query.seq)) {
    return Added::kUnknownKeyframe;
  }
  return map->matches.contains(match.query.seq) ? Added::kRepeat : Added::kNew;
}

JournalIndex::Added JournalIndex::Check(const Constraint& constraint) const {
  const MapIndex* map = FindMap(constraint.to.map);
  if (map == nullptr || !map->keyframes.contains(constraint.to.seq)) {
    return Added::kUnknownKeyframe;
  }
  const auto results = map->results.find(constraint.to.seq);
  if (results == map->results.end()) {
    return Added::kNew;
  }
  const bool known = results->second.contains(constraint.Id());
  return known || results->second.size() >= kMaxResults ? Added::kRepeat : Added::kNew;
}

void JournalIndex::Add(const PlaceMatch& match, const JournalPlace& place) {
  MapIndex& map = maps_[match.query.map];
  if (!map.matches.emplace(match.query.seq, place).second) {
    return;
  }
  ++num_matches_;
  const auto results = map.results.find(match.query.seq);
  for (const PlaceCandidate& candidate : match.candidates) {
    const int64_t expected = ConstraintId(match.query, candidate);
    const bool known = results != map.results.end() && results->second.contains(expected);
    if (!known && map.missing_results[match.query.seq].insert(expected).second) {
      ++num_missing_results_;
    }
  }
  for (auto it = map.keyframes.lower_bound(map.matched_below);
       it != map.keyframes.end() && map.matches.contains(it->first); ++it) {
    map.matched_below = it->first + 1;
  }
}

void JournalIndex::Add(const Constraint& constraint, const JournalPlace& place) {
  MapIndex& map = maps_[constraint.to.map];
  const bool added = map.results[constraint.to.seq].emplace(constraint.Id(), place).second;
  num_constraints_ += added ? 1 : 0;
  const auto missing = map.missing_results.find(constraint.to.seq);
  if (missing != map.missing_results.end() && missing->second.erase(constraint.Id()) > 0) {
    --num_missing_results_;
    if (missing->second.empty()) {
      map.missing_results.erase(missing);
    }
  }
}

std::vector<JournalPlace> JournalIndex::Find(JournalChannel channel, const KeyframeId& id) const {
  const MapIndex* map = FindMap(id.map);
  if (map == nullptr) {
    return {};
  }
  std::vector<JournalPlace> places;
  if (channel == JournalChannel::kConstraint) {
    const auto it = map->results.find(id.seq);
    if (it != map->results.end()) {
      for (const auto& [constraint_id, place] : it->second) {
        places.push_back(place);
      }
    }
    return places;
  }
  const auto& single = channel == JournalChannel::kKeyframe ? map->keyframes : map->matches;
  const auto it = single.find(id.seq);
  if (it != single.end()) {
    places.push_back(it->second);
  }
  return places;
}

std::vector<JournalPlace> JournalIndex::Find(const ResultNames& names) const {
  std::vector<JournalPlace> places;
  const MapIndex* map = FindMap(names.map);
  if (map == nullptr) {
    return places;
  }
  for (const auto& [seq, constraint_id] : names.results) {
    const auto of_keyframe = map->results.find(seq);
    if (of_keyframe == map->results.end()) {
      continue;
    }
    const auto result = of_keyframe->second.find(constraint_id);
    if (result != of_keyframe->second.end()) {
      places.push_back(result->second);
    }
  }
  return places;
}

int32_t JournalIndex::Highest(const MapId& id) const {
  const MapIndex* map = FindMap(id);
  return map == nullptr || map->keyframes.empty() ? -1 : map->keyframes.rbegin()->first;
}

std::vector<MapId> JournalIndex::Maps() const {
  std::vector<MapId> ids;
  for (const auto& [id, map] : maps_) {
    ids.push_back(id);
  }
  return ids;
}

std::vector<SeqGap> JournalIndex::Gaps(const MapId& id) const {
  const MapIndex* map = FindMap(id);
  std::vector<SeqGap> gaps;
  if (map == nullptr || static_cast<int64_t>(map->keyframes.size()) == Highest(id) + 1) {
    return gaps;
  }
  int32_t next = 0;
  for (const auto& [seq, place] : map->keyframes) {
    if (seq > next) {
      gaps.push_back({id, next, seq - 1});
    }
    next = seq + 1;
  }
  return gaps;
}

std::optional<SeqGap> JournalIndex::MissingMatches(const MapId& id, int32_t up_to) const {
  const MapIndex* map = FindMap(id);
  if (map == nullptr) {
    return std::nullopt;
  }
  for (auto it = map->keyframes.lower_bound(map->matched_below);
       it != map->keyframes.end() && it->first <= up_to; ++it) {
    if (!map->matches.contains(it->first)) {
      const auto next = map->matches.upper_bound(it->first);
      const int32_t end = next == map->matches.end() ? up_to : next->first - 1;
      return SeqGap{id, it->first, std::min(up_to, end)};
    }
  }
  return std::nullopt;
}

ResultNames JournalIndex::MissingResults(const MapId& id, int32_t up_to) const {
  ResultNames names{id, {}};
  const MapIndex* map = FindMap(id);
  if (map == nullptr) {
    return names;
  }
  for (const auto& [seq, constraint_ids] : map->missing_results) {
    for (const int64_t constraint_id : constraint_ids) {
      if (seq > up_to || names.results.size() == ResultNames::kMax) {
        return names;
      }
      names.results.emplace_back(seq, constraint_id);
    }
  }
  return names;
}

}  // namespace pangea
