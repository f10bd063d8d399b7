#include "cluster/pending_matches.h"

#include <algorithm>

#include "core/candidates/candidate_order.h"
#include "core/server_messages.h"
#include "messages/encoding.h"
#include "messages/messages.h"

namespace pangea {
namespace {

// Not more often, because reading a match from NATS transfers 30 kB.
constexpr int64_t kLookInterval_us = 1'000'000;

}  // namespace

bool PendingMatches::LetPass(const PlaceMatch& match, int64_t now_utime) {
  std::set<MapId> maps{match.query.map};
  for (const PlaceCandidate& candidate : match.candidates) {
    maps.insert(candidate.match.map);
  }
  const auto queries = FirstOf(maps);
  if (!queries) {
    return false;
  }
  PendingQueries pending;
  std::ranges::for_each(*queries, [&](const KeyframeId& query) { pending.Add(query); });
  const bool waits = std::ranges::any_of(match.candidates, [&](const PlaceCandidate& candidate) {
    return pending.Precede(match.query, candidate.match);
  });
  if (waits && now_utime >= next_look_utime_) {
    next_look_utime_ = now_utime + kLookInterval_us;
    LookForFinished(*queries);
  }
  return !waits;
}

std::optional<std::vector<KeyframeId>> PendingMatches::FirstOf(const std::set<MapId>& maps) {
  std::vector<KeyframeId> first;
  for (const MapId& map : maps) {
    auto queries = streams_.PendingMatchesOf(map);
    if (!queries) {
      return std::nullopt;
    }
    finished_.RemoveFrom(map, &*queries);
    if (const auto found = std::ranges::min_element(*queries); found != queries->end()) {
      first.push_back(*found);
    }
  }
  return first;
}

bool PendingMatches::HasAllResults(const KeyframeId& query) {
  const auto message = streams_.FindMatch(query);
  const auto match = message ? ParseMessage<place_match_t>(message->data).value : std::nullopt;
  return match && std::ranges::all_of(match->candidates, [&](const PlaceCandidate& candidate) {
           return streams_.FindResult(query, ConstraintId(query, candidate)).has_value();
         });
}

void PendingMatches::LookForFinished(const std::vector<KeyframeId>& queries) {
  for (const KeyframeId& query : queries) {
    if (HasAllResults(query)) {
      finished_.Add(query);
    }
  }
}

}  // namespace pangea
