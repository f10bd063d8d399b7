#pragma once

// The order that candidates of place recognition have among each other. Which of them are redundant
// rests on the results before (loop_verification/known_constraints.h); so that it is the same
// whenever they come and whoever verifies them, a candidate rests on all candidates whose query is,
// in its map, before this one's query or before its match, and waits for their results. All of
// these keyframes came before this one's query: no two candidates wait for each other.

#include <algorithm>
#include <cstdint>
#include <map>

#include "core/ids.h"

namespace pangea {

// Whether a candidate rests on those of `earlier_query`.
inline bool RestsOn(const KeyframeId& query, const KeyframeId& match,
                    const KeyframeId& earlier_query) {
  const auto before = [&](const KeyframeId& id) {
    return earlier_query.map == id.map && earlier_query.seq < id.seq;
  };
  return before(query) || before(match);
}

// Queries with candidates that lack a result.
class PendingQueries {
 public:
  void Add(const KeyframeId& query) {
    const auto [first, is_new] = first_seq_.emplace(query.map, query.seq);
    first->second = std::min(first->second, query.seq);
  }
  // Whether this candidate rests on any of theirs.
  bool Precede(const KeyframeId& query, const KeyframeId& match) const {
    return std::ranges::any_of(first_seq_, [&](const auto& first) {
      return RestsOn(query, match, {first.first, first.second});
    });
  }

 private:
  std::map<MapId, int32_t> first_seq_;
};

}  // namespace pangea
