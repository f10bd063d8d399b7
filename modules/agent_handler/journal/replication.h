#pragma once

// Decides which part of the journal is "kept", that is, may be acknowledged. On a single host it is
// what the disk has. On a site of several hosts, it is what other hosts have too, as the bridge on
// this host says (JOURNAL_REPLICATED, docs/cluster.md). In that case no agent is answered before
// everything that was in the journal at the start is replicated, nor while the bridge is silent,
// because another host may have become the core. Monotonic microseconds go in.

#include <cstdint>
#include <deque>
#include <vector>

#include "core/ids.h"

namespace pangea {

class Replication {
 public:
  // A bridge publishes JOURNAL_REPLICATED at least four times per second.
  static constexpr int64_t kLongestSilence_us = 1'500'000;

  // Events that were written to the disk together.
  struct Group {
    int64_t journal_bytes = 0;  // size of the journal up to the end of this group
    std::vector<KeyframeId> keyframes;
    int64_t num_edits = 0;  // number of edits of anchors in the journal up to here
  };

  // `wanted`: whether other hosts must have the journal too. `journal_bytes`: its size at the
  // start.
  Replication(bool wanted, int64_t journal_bytes)
      : wanted_(wanted), bytes_at_start_(journal_bytes) {}

  void Add(Group group) { groups_.push_back(std::move(group)); }
  void OnReplicated(int64_t journal_bytes, int64_t now_us);
  // The groups that became kept since the last call.
  std::vector<Group> TakeKept();

  bool wanted() const { return wanted_; }
  // Whether agents may be answered.
  bool Works(int64_t now_us) const;
  // Whether keyframes of the agent are on the disk but not kept yet.
  bool Awaits(int32_t agent_id) const;

 private:
  const bool wanted_;
  const int64_t bytes_at_start_;
  int64_t replicated_bytes_ = -1;
  int64_t heard_us_ = 0;
  std::deque<Group> groups_;
};

}  // namespace pangea
