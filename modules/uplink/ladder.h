#pragma once

// Decides what an agent leaves out of its keyframes so that they fit a budget in bytes per second.
// First corners of each keyframe are left out; then only every second, third or fourth keyframe has
// corners. No keyframe is left out, so the chain of poses has no gap.
//
// The rate of the link is not measured. Bytes sent are a debt, which is paid off at the budget's
// rate. If the debt is more than two seconds of budget and does not shrink on this rung, the ladder
// goes up one rung; if there is no debt after six keyframes, it goes down one. So it alternates
// between two rungs and uses the whole budget. Time goes in; no clock.

#include <cstdint>

namespace pangea {

struct LadderRung {
  int untracked = 0;  // number of corners kept beside tracked ones and map points
  int every = 1;      // one of `every` keyframes has corners
};

class RateLadder {
 public:
  static constexpr int kNumRungs = 7;
  static const LadderRung& Rung(int rung);

  explicit RateLadder(double budget_bytes_per_s);

  // Call it before each new keyframe: it decides how many corners this one has. `now_us`:
  // monotonic; `waiting_bytes`: bytes that wait to be sent.
  struct Choice {
    bool bare = false;  // no corners at all
    int untracked = 0;  // as in LadderRung
  };
  Choice Next(int64_t now_us, int64_t waiting_bytes);
  // The keyframe will be sent and has so many bytes.
  void Charge(int64_t bytes) { debt_bytes_ += static_cast<double>(bytes); }

  int rung() const { return rung_; }
  double budget_bytes_per_s() const { return budget_; }

 private:
  void Change(int by);

  const double budget_;
  double debt_bytes_ = 0;
  int64_t last_us_ = 0;
  int rung_ = 0;
  int since_change_ = 0;  // keyframes since the last change of rung
  double debt_at_change_ = 0;
  int since_corners_ = 1000;  // keyframes since the last one with corners; the first one has some
};

}  // namespace pangea
