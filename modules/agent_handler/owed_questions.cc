#include "agent_handler/owed_questions.h"

#include <algorithm>

namespace pangea {
namespace {

// What a keyframe's match and verdicts may take before they are asked for; then ever more rarely.
constexpr int64_t kFirstAsk_us = 3'000'000;
constexpr int64_t kMaxAsk_us = 60'000'000;

}  // namespace

std::vector<OwedQuestions::Question> OwedQuestions::Due(const JournalIndex& index, int64_t now_us) {
  std::vector<Question> questions;
  const auto ask = [&](Owed* owed, const MapId& map, JournalChannel channel, auto missing) {
    if (now_us < owed->next_ask_us) {
      return;
    }
    std::optional<SeqGap> gap = (index.*missing)(map, owed->seen_before);
    const bool stuck = gap && gap->from_seq == owed->asked_from;
    owed->wait_us = stuck ? std::min(2 * owed->wait_us, kMaxAsk_us) : kFirstAsk_us;
    owed->next_ask_us = now_us + owed->wait_us;
    owed->asked_from = gap ? gap->from_seq : -1;
    owed->seen_before = index.Highest(map);
    if (gap) {
      gap->to_seq = std::min(gap->to_seq, gap->from_seq + kMaxAsked - 1);
      questions.push_back({channel, *gap});
    }
  };
  for (const MapId& map : index.Maps()) {
    ask(&matches_[map], map, JournalChannel::kPlaceMatch, &JournalIndex::MissingMatches);
    ask(&verdicts_[map], map, JournalChannel::kConstraint, &JournalIndex::MissingVerdicts);
  }
  return questions;
}

}  // namespace pangea
