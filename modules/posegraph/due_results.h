#pragma once

// Verification results that a PLACE_MATCH promised: which came, and when those that did not are
// asked for by name (posegraph_process.h says why and how often). Bounds: kMax of them are watched.

#include <cstdint>
#include <map>
#include <set>

#include "bus/node.h"
#include "bus/retransmission/journal_follower.h"
#include "core/byte_record.h"
#include "core/server_messages.h"

namespace pangea {

class DueResults {
 public:
  void Promise(const PlaceMatch& match, int64_t now_utime);
  // False when it is a repeat.
  bool MarkReceived(int64_t constraint_id);
  // Looked at once a second.
  void RequestOverdue(Node& node, int64_t now_utime);

  void Save(ByteWriter* writer) const;
  // As if they were promised now.
  void Restore(ByteReader* reader, int64_t now_utime);

  size_t size() const { return due_.size(); }
  // Of the journal, still to come.
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
