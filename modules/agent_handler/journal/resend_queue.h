#pragma once

// Requests for old messages, answered one after the other so that a restarted process catches up
// without flooding the bus; requesters in turn, one message each, so that none hears nothing for
// long while others catch up with many maps. Bounded: kMaxRequests of each of kMaxRequesters wait;
// one that is covered by a waiting one is dropped, and so is one beyond the bound (who still misses
// something repeats the request).

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "agent_handler/journal/journal_index.h"
#include "pangea/resend_request_t.hpp"

namespace pangea {

class ResendQueue {
 public:
  static constexpr size_t kMaxRequests = 1000;
  static constexpr size_t kMaxRequesters = 50;
  static constexpr size_t kMaxNamed = 200;

  // Why it was refused, or an empty string.
  std::string Add(const resend_request_t& request, const JournalIndex& index);
  // For the verification results that are journalled; the others will come. False when too many
  // requests wait.
  bool Add(const VerificationRequest& request, const JournalIndex& index);

  struct Answer {
    std::string requester;
    std::string channel;
    std::vector<JournalPlace> places;  // of one keyframe, or asked for by name; may be empty
  };
  std::optional<Answer> Next(const JournalIndex& index);
  size_t waiting() const;

 private:
  struct Request {
    std::string channel_name;
    JournalChannel channel;
    MapId map;
    int32_t next_seq;
    int32_t to_seq;
  };
  std::map<std::string, std::deque<Request>> requests_;  // by requester; none is empty
  std::string answered_;                                 // the last one
  std::deque<Answer> named_;  // answers to requests that name verification results
};

}  // namespace pangea
