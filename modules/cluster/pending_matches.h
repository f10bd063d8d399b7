#pragma once

// Which of the queue's matches others still have to wait for (core/candidates/candidate_order.h).
// One thread.

#include <cstdint>
#include <optional>
#include <set>
#include <vector>

#include "cluster/site_streams.h"
#include "core/server_messages.h"

namespace pangea {

class PendingMatches {
 public:
  explicit PendingMatches(SiteStreams& streams) : streams_(streams) {}

  // Whether no candidate of the match rests on one that lacks its result. False also when NATS does
  // not answer.
  bool LetPass(const PlaceMatch& match, int64_t now_utime);

 private:
  // Of each map's pending queries the first. Nothing: NATS does not answer.
  std::optional<std::vector<KeyframeId>> FirstOf(const std::set<MapId>& maps);
  bool HasAllResults(const KeyframeId& query);
  void LookForFinished(const std::vector<KeyframeId>& queries);

  SiteStreams& streams_;
  // An acknowledged match stays in the stream for ever if NATS was killed before it forgot it.
  std::set<KeyframeId> finished_;
  int64_t next_look_utime_ = 0;
};

}  // namespace pangea
