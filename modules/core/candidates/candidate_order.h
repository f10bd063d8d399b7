#pragma once

// The order in which candidates of place recognition are decided. Whether a candidate is redundant
// depends on earlier results (loop_verification/known_constraints.h). To make this independent of
// arrival times and of who verifies, a candidate waits for the results of all candidates whose
// query precedes, in the same map, this candidate's query or its match. All these keyframes came
// before this candidate's query, so no two candidates wait for each other.

#include <algorithm>
#include <cstdint>
#include <map>

#include "core/ids.h"

namespace pangea {

// Whether the candidate (query, match) waits for the results of the candidates of `earlier_query`.
inline bool RestsOn(const KeyframeId& query, const KeyframeId& match,
                    const KeyframeId& earlier_query) {
  const auto before = [&](const KeyframeId& id) {
    return earlier_query.map == id.map && earlier_query.seq < id.seq;
  };
  return before(query) || before(match);
}

// The queries that have candidates without a result. Only the first one of each map is kept.
class PendingQueries {
 public:
  void Add(const KeyframeId& query) {
    const auto [first, is_new] = first_seq_.emplace(query.map, query.seq);
    first->second = std::min(first->second, query.seq);
  }
  // Whether the candidate (query, match) waits for any candidate of these queries.
  bool Precede(const KeyframeId& query, const KeyframeId& match) const {
    return std::ranges::any_of(first_seq_, [&](const auto& first) {
      return RestsOn(query, match, {first.first, first.second});
    });
  }

 private:
  std::map<MapId, int32_t> first_seq_;
};

}  // namespace pangea
