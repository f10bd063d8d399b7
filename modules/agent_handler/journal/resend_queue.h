#pragma once

// A queue of requests for journalled messages. They are answered one after the other, so that a
// restarted process catches up without flooding the bus. Requesters take turns, one keyframe's
// messages each, so that nobody waits for long while others catch up with many maps.
//
// Bounded: kMaxRequests of each of kMaxRequesters wait. A request that a waiting one covers is
// dropped, and so is one beyond the bound (a requester that still lacks messages repeats its
// request).

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

  // Returns why the request was refused, or an empty string.
  std::string Add(const resend_request_t& request, const JournalIndex& index);
  // A request for named verification results; only those that are journalled are sent. False when
  // too many requests wait.
  bool Add(const VerificationRequest& request, const JournalIndex& index);

  struct Answer {
    std::string requester;
    std::string channel;
    std::vector<JournalPlace> places;  // messages of one keyframe, or named results; may be empty
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
  std::string answered_;                                 // the requester answered last
  std::deque<Answer> named_;  // answers to requests that name verification results
};

}  // namespace pangea
