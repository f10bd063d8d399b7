#pragma once

// Verification results that a PLACE_MATCH promised: records which of them arrived, and requests the
// overdue ones by constraint id (posegraph_process.h says why and how often). At most kMax are
// watched; a result promised beyond that is not requested.

#include <cstdint>
#include <map>
#include <set>

#include "bus/node.h"
#include "core/byte_record.h"
#include "core/server_messages.h"
#include "journal_follower/journal_follower.h"

namespace pangea {

class DueResults {
 public:
  void Promise(const PlaceMatch& match, int64_t now_utime);
  // False if this result was received before.
  bool MarkReceived(int64_t constraint_id);
  // Publishes the requests; does nothing if it was called less than a second ago.
  void RequestOverdue(Node& node, int64_t now_utime);

  void Save(ByteWriter* writer) const;
  // Every outstanding result is then treated as if it had been promised at `now_utime`.
  void Restore(ByteReader* reader, int64_t now_utime);

  size_t size() const { return due_.size(); }
  // Number of results that the journal may hold and that have not arrived. A result requested twice
  // without an answer is not counted: it is not in the journal and has yet to be verified.
  int64_t NumToCatchUp(const JournalFollower& journal) const;

 private:
  static constexpr size_t kMax = 20000;

  void Watch(int64_t constraint_id, const KeyframeId& query, int64_t now_utime);

  struct Due {
    KeyframeId query;
    int64_t next_ask_utime = 0;
    int64_t wait_us = 0;
  };

  std::map<int64_t, Due> due_;  // by constraint id
  std::set<int64_t> received_;
  int64_t next_look_utime_ = 0;
};

}  // namespace pangea
