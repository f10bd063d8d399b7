#pragma once

// What of the journal is kept, and may be acknowledged: what the disk has, or, for a site of
// several hosts, what the bridge beside us says that other hosts have too (JOURNAL_REPLICATED,
// cluster.md). Then nobody is answered before all that a start found is there, nor while the bridge
// is silent: another host may be the core by then. Time goes in (microseconds).

#include <cstdint>
#include <deque>
#include <vector>

#include "core/ids.h"

namespace pangea {

class Replication {
 public:
  // A bridge tells at least four times a second.
  static constexpr int64_t kLongestSilence_us = 1'500'000;

  // What was synced together.
  struct Group {
    int64_t journal_bytes = 0;  // with it
    std::vector<KeyframeId> keyframes;
    int64_t num_edits = 0;  // of anchors, in the journal with it
  };

  // `wanted`: by others too. `journal_bytes`: at the start.
  Replication(bool wanted, int64_t journal_bytes)
      : wanted_(wanted), bytes_at_start_(journal_bytes) {}

  void Add(Group group) { groups_.push_back(std::move(group)); }
  void OnReplicated(int64_t journal_bytes, int64_t now_us);
  // What is kept since the last call.
  std::vector<Group> TakeKept();

  bool wanted() const { return wanted_; }
  // Whether agents may be answered.
  bool Works(int64_t now_us) const;
  // Whether keyframes of the agent are on the disk and not kept yet.
  bool Awaits(int32_t agent_id) const;

 private:
  const bool wanted_;
  const int64_t bytes_at_start_;
  int64_t replicated_bytes_ = -1;
  int64_t heard_us_ = 0;
  std::deque<Group> groups_;
};

}  // namespace pangea
