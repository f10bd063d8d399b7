#pragma once

// What is outstanding from the other processes for the journal: exactly one match per keyframe and
// one verification result per candidate. They may only be slow, so it is asked seldom, and more
// seldom while nothing comes. No bus, no clock: time goes in (microseconds), requests come out.

#include <cstdint>
#include <map>
#include <vector>

#include "agent_handler/journal/journal_index.h"

namespace pangea {

class OutstandingResults {
 public:
  struct Requests {
    std::vector<SeqGap> matches;  // keyframes whose matches are missing, at most kMaxAsked each
    std::vector<ResultNames> results;
  };
  static constexpr int32_t kMaxAsked = 100;

  // The requests to make now.
  Requests Due(const JournalIndex& index, int64_t now_us);

 private:
  struct Outstanding {
    int32_t seen_before = -1;  // keyframes there were at the last round
    int32_t asked_from = -1;
    int64_t next_ask_us = 0;
    int64_t wait_us = 0;

    // The first keyframe that lacks something; -1 for none.
    void NoteRequested(int32_t first_seq, int32_t highest_seq, int64_t now_us);
  };

  std::map<MapId, Outstanding> matches_;
  std::map<MapId, Outstanding> results_;
};

}  // namespace pangea
