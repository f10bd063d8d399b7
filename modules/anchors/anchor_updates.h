#pragma once

// Which anchors a listener is told of now: those that changed, at most every kInterval_us each, and
// each again every kRepeat_us for whoever came late. An anchor that is gone is told kTimesGone
// times in a row first.
//
// In: all that the listener is to know, and the time. Bounded: what is no longer among that is
// forgotten.

#include <cstdint>
#include <map>
#include <set>
#include <vector>

#include "core/anchor.h"

namespace pangea {

// An anchor that moved by no more has not.
inline constexpr double kAnchorMoved_m = 0.002;
inline constexpr double kAnchorMoved_rad = 0.002;

class AnchorUpdates {
 public:
  static constexpr int64_t kInterval_us = 500'000;
  static constexpr int64_t kRepeat_us = 10'000'000;
  static constexpr int kTimesGone = 3;

  std::vector<AnchorState> Due(const std::vector<AnchorState>& states, int64_t now_utime);
  // What the listener knows as placed.
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
