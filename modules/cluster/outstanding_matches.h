#pragma once

// The place matches that a worker has taken from the queue, and which verification results each of
// them still lacks. A match is done when the results of all its candidates are stored, whoever made
// them. No bus, no NATS, no clock: time goes in (microseconds).

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/server_messages.h"

namespace pangea {

class OutstandingMatches {
 public:
  // A match of which at least one candidate lacks its result; candidates that have one are left
  // out of it. `ack_subject` is where the queue is told of it. The same match again: the newer
  // one counts.
  void Add(PlaceMatch match, std::string ack_subject, int64_t now_us);

  // A result is stored. Its match's ack_subject if that lacks nothing any more; then it is
  // forgotten.
  std::optional<std::string> NoteStored(int64_t constraint_id);

  // Matches whose results are overdue, with the candidates that lack one; each ever more rarely.
  std::vector<PlaceMatch> Overdue(int64_t now_us);

  bool Lacks(int64_t constraint_id) const { return lacking_.contains(constraint_id); }
  std::vector<std::string> AckSubjects() const;
  size_t size() const { return matches_.size(); }
  // Results.
  size_t num_lacking() const { return lacking_.size(); }

 private:
  struct Outstanding {
    PlaceMatch match;  // with the candidates that lack their result
    std::string ack_subject;
    int64_t next_ask_us = 0;
    int64_t wait_us = 0;
  };
  std::map<KeyframeId, Outstanding> matches_;
  std::map<int64_t, KeyframeId> lacking_;  // constraint id to the match's query
};

}  // namespace pangea
