#pragma once

// Decides when the journal asks other processes for missing messages: there must be exactly one
// match per keyframe and one verification result per candidate. These processes may just be slow,
// so it asks seldom, and less often while nothing comes. No bus, no clock: monotonic microseconds
// go in, requests come out.

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
    int32_t seen_before = -1;  // highest seq at the last round; newer keyframes are not asked about
    int32_t asked_from = -1;
    int64_t next_ask_us = 0;
    int64_t wait_us = 0;

    // `first_seq`: the first keyframe that lacks something; -1: none.
    void NoteRequested(int32_t first_seq, int32_t highest_seq, int64_t now_us);
  };

  std::map<MapId, Outstanding> matches_;
  std::map<MapId, Outstanding> results_;
};

}  // namespace pangea
