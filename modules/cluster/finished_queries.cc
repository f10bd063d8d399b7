#include "cluster/finished_queries.h"

#include <limits>
#include <utility>

namespace pangea {

void FinishedQueries::Add(const KeyframeId& query) {
  queries_.insert(query);
  if (queries_.size() > kMaxQueries) {
    queries_.erase(queries_.begin());
  }
}

void FinishedQueries::RemoveFrom(const MapId& map, std::vector<KeyframeId>* pending) {
  std::vector<KeyframeId> still_pending;
  std::erase_if(*pending, [&](const KeyframeId& query) {
    const bool finished = queries_.contains(query);
    if (finished) {
      still_pending.push_back(query);
    }
    return finished;
  });
  queries_.erase(queries_.lower_bound({map, 0}),
                 queries_.upper_bound({map, std::numeric_limits<int32_t>::max()}));
  queries_.insert(still_pending.begin(), still_pending.end());
}

}  // namespace pangea
