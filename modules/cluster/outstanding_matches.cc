#include "cluster/outstanding_matches.h"

#include <algorithm>
#include <utility>

#include "core/server_messages.h"

namespace pangea {
namespace {

// Verifying a match takes tenths of a second. Asking too early does no harm: the verifier only
// repeats its result.
constexpr int64_t kFirstAsk_us = 3'000'000;
constexpr int64_t kMaxAsk_us = 60'000'000;

}  // namespace

void OutstandingMatches::Add(PlaceMatch match, std::string ack_subject, int64_t now_us) {
  const KeyframeId query = match.query;
  // Results that another worker has stored since the match was added before.
  std::erase_if(lacking_, [&query](const auto& lacking) { return lacking.second == query; });
  for (const PlaceCandidate& candidate : match.candidates) {
    lacking_.emplace(ConstraintId(query, candidate), query);
  }
  matches_.insert_or_assign(query, Outstanding{std::move(match), std::move(ack_subject),
                                               now_us + kFirstAsk_us, kFirstAsk_us});
}

std::optional<std::string> OutstandingMatches::NoteStored(int64_t constraint_id) {
  const auto lacking = lacking_.find(constraint_id);
  if (lacking == lacking_.end()) {
    return std::nullopt;
  }
  const auto outstanding = matches_.find(lacking->second);
  lacking_.erase(lacking);
  PlaceMatch& match = outstanding->second.match;
  std::erase_if(match.candidates, [&](const PlaceCandidate& candidate) {
    return ConstraintId(match.query, candidate) == constraint_id;
  });
  if (!match.candidates.empty()) {
    return std::nullopt;
  }
  std::string ack_subject = std::move(outstanding->second.ack_subject);
  matches_.erase(outstanding);
  return ack_subject;
}

std::vector<PlaceMatch> OutstandingMatches::Overdue(int64_t now_us) {
  std::vector<PlaceMatch> overdue;
  for (auto& [query, outstanding] : matches_) {
    if (now_us >= outstanding.next_ask_us) {
      outstanding.wait_us = std::min(2 * outstanding.wait_us, kMaxAsk_us);
      outstanding.next_ask_us = now_us + outstanding.wait_us;
      overdue.push_back(outstanding.match);
    }
  }
  return overdue;
}

std::vector<std::string> OutstandingMatches::AckSubjects() const {
  std::vector<std::string> ack_subjects;
  for (const auto& [query, outstanding] : matches_) {
    ack_subjects.push_back(outstanding.ack_subject);
  }
  return ack_subjects;
}

}  // namespace pangea
