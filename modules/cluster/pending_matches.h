#pragma once

// Decides whether a match must wait for other matches in the queue
// (core/candidates/candidate_order.h). Not thread safe.

#include <cstdint>
#include <optional>
#include <set>
#include <vector>

#include "cluster/finished_queries.h"
#include "cluster/site_streams.h"
#include "core/server_messages.h"

namespace pangea {

class PendingMatches {
 public:
  explicit PendingMatches(SiteStreams& streams) : streams_(streams) {}

  // True if no candidate of the match has to wait for a candidate without a result. False also when
  // NATS does not answer.
  bool LetPass(const PlaceMatch& match, int64_t now_utime);

 private:
  // The first pending query of each map. Nothing if NATS does not answer.
  std::optional<std::vector<KeyframeId>> FirstOf(const std::set<MapId>& maps);
  bool HasAllResults(const KeyframeId& query);
  void LookForFinished(const std::vector<KeyframeId>& queries);

  SiteStreams& streams_;
  FinishedQueries finished_;
  int64_t next_look_utime_ = 0;
};

}  // namespace pangea
