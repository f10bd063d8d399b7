#pragma once

// Decides which anchors to send to one receiver now. A changed anchor is sent, but each at most
// every kInterval_us. Every anchor is repeated every kRepeat_us, for receivers that start late. A
// deleted anchor is first sent kTimesGone times, every kInterval_us.
//
// Input: the states of all anchors for this receiver, and the time. Bounded: an anchor that is no
// longer in the input is forgotten.

#include <cstdint>
#include <map>
#include <set>
#include <vector>

#include "core/anchor.h"

namespace pangea {

// An anchor that moved by no more than this is unchanged.
inline constexpr double kAnchorMoved_m = 0.002;
inline constexpr double kAnchorMoved_rad = 0.002;

class AnchorUpdates {
 public:
  static constexpr int64_t kInterval_us = 500'000;
  static constexpr int64_t kRepeat_us = 10'000'000;
  static constexpr int kTimesGone = 3;

  std::vector<AnchorState> Due(const std::vector<AnchorState>& states, int64_t now_utime);
  // The anchors that the receiver may still believe to be placed.
  std::set<AnchorId> Told() const;

 private:
  struct Sent {
    AnchorState state;
    int64_t utime = 0;
    int times_gone = 0;
  };

  static bool IsDue(const AnchorState& state, const Sent& sent, int64_t now_utime);

  std::map<AnchorId, Sent> sent_;
};

}  // namespace pangea
