#include "agent_handler/journal/owed_questions.h"

#include <algorithm>
#include <optional>
#include <utility>

namespace pangea {
namespace {

// What a keyframe's match and verdicts may take before they are asked for; then ever more rarely.
constexpr int64_t kFirstAsk_us = 3'000'000;
constexpr int64_t kMaxAsk_us = 60'000'000;

}  // namespace

void OwedQuestions::Owed::NoteAsked(int32_t first_seq, int32_t highest_seq, int64_t now_us) {
  const bool stuck = first_seq >= 0 && first_seq == asked_from;
  wait_us = stuck ? std::min(2 * wait_us, kMaxAsk_us) : kFirstAsk_us;
  next_ask_us = now_us + wait_us;
  asked_from = first_seq;
  seen_before = highest_seq;
}

OwedQuestions::Questions OwedQuestions::Due(const JournalIndex& index, int64_t now_us) {
  Questions questions;
  for (const MapId& map : index.Maps()) {
    if (Owed& owed = matches_[map]; now_us >= owed.next_ask_us) {
      std::optional<SeqGap> gap = index.MissingMatches(map, owed.seen_before);
      owed.NoteAsked(gap ? gap->from_seq : -1, index.Highest(map), now_us);
      if (gap) {
        gap->to_seq = std::min(gap->to_seq, gap->from_seq + kMaxAsked - 1);
        questions.matches.push_back(*gap);
      }
    }
    if (Owed& owed = verdicts_[map]; now_us >= owed.next_ask_us) {
      VerdictNames names = index.MissingVerdicts(map, owed.seen_before);
      owed.NoteAsked(names.verdicts.empty() ? -1 : names.verdicts.front().first, index.Highest(map),
                     now_us);
      if (!names.verdicts.empty()) {
        questions.verdicts.push_back(std::move(names));
      }
    }
  }
  return questions;
}

}  // namespace pangea
