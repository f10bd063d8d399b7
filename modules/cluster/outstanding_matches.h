#pragma once

// The place matches that a worker has taken from the queue, and the verification results that each
// of them still lacks. A match is done when the results of all its candidates are stored, no matter
// which worker made them. No bus, no NATS, no clock: microseconds go in.

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/server_messages.h"

namespace pangea {

class OutstandingMatches {
 public:
  // `match` has only the candidates without a result, at least one. `ack_subject`: for the queue.
  // If the match was added before, the new one replaces it.
  void Add(PlaceMatch match, std::string ack_subject, int64_t now_us);

  // A result was stored. If its match now has all results, returns the match's ack_subject and
  // forgets the match.
  std::optional<std::string> NoteStored(int64_t constraint_id);

  // The matches whose results are overdue, with the candidates that lack one. The interval at which
  // a match is returned again doubles.
  std::vector<PlaceMatch> Overdue(int64_t now_us);

  bool Lacks(int64_t constraint_id) const { return lacking_.contains(constraint_id); }
  std::vector<std::string> AckSubjects() const;
  size_t size() const { return matches_.size(); }
  // Number of missing results.
  size_t num_lacking() const { return lacking_.size(); }

 private:
  struct Outstanding {
    PlaceMatch match;  // with the candidates that lack a result
    std::string ack_subject;
    int64_t next_ask_us = 0;
    int64_t wait_us = 0;
  };
  std::map<KeyframeId, Outstanding> matches_;
  std::map<int64_t, KeyframeId> lacking_;  // id of a missing result -> query of its match
};

}  // namespace pangea
