#include "agent_handler/journal/outstanding_results.h"

#include <algorithm>
#include <optional>
#include <utility>

namespace pangea {
namespace {

// How long a keyframe's match and verification results may take before they are asked for. The
// interval then doubles up to kMaxAsk_us.
constexpr int64_t kFirstAsk_us = 3'000'000;
constexpr int64_t kMaxAsk_us = 60'000'000;

}  // namespace

void OutstandingResults::Outstanding::NoteRequested(int32_t first_seq, int32_t highest_seq,
                                                    int64_t now_us) {
  const bool stuck = first_seq >= 0 && first_seq == asked_from;
  wait_us = stuck ? std::min(2 * wait_us, kMaxAsk_us) : kFirstAsk_us;
  next_ask_us = now_us + wait_us;
  asked_from = first_seq;
  seen_before = highest_seq;
}

OutstandingResults::Requests OutstandingResults::Due(const JournalIndex& index, int64_t now_us) {
  Requests requests;
  for (const MapId& map : index.Maps()) {
    if (Outstanding& outstanding = matches_[map]; now_us >= outstanding.next_ask_us) {
      std::optional<SeqGap> gap = index.MissingMatches(map, outstanding.seen_before);
      outstanding.NoteRequested(gap ? gap->from_seq : -1, index.Highest(map), now_us);
      if (gap) {
        gap->to_seq = std::min(gap->to_seq, gap->from_seq + kMaxAsked - 1);
        requests.matches.push_back(*gap);
      }
    }
    if (Outstanding& outstanding = results_[map]; now_us >= outstanding.next_ask_us) {
      ResultNames names = index.MissingResults(map, outstanding.seen_before);
      outstanding.NoteRequested(names.results.empty() ? -1 : names.results.front().first,
                                index.Highest(map), now_us);
      if (!names.results.empty()) {
        requests.results.push_back(std::move(names));
      }
    }
  }
  return requests;
}

}  // namespace pangea
