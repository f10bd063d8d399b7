#pragma once

// What an agent leaves out of its keyframes so that they fit a budget of bytes a second: first
// corners of each keyframe, then all corners of every second, third, fourth one. Never a keyframe:
// the chain of poses has no gap.
//
// An account rather than a measurement of the link: bytes sent are a debt, paid off at the budget's
// rate. A debt of more than two seconds of budget that this rung does not pay off is a rung up;
// none at all, after six keyframes, a rung down. Between two rungs of which one is too dear it so
// goes back and forth, and the budget is used up. Time goes in; no clock.

#include <cstdint>

namespace pangea {

struct LadderRung {
  int untracked = 0;  // corners kept beside tracked ones and map points
  int every = 1;      // of so many keyframes one has corners
};

class RateLadder {
 public:
  static constexpr int kNumRungs = 7;
  static const LadderRung& Rung(int rung);

  explicit RateLadder(double budget_bytes_per_s);

  // Before each new keyframe: whether this one has corners, and how many; from the debt, and from
  // the bytes that wait to be sent.
  struct Choice {
    bool bare = false;
    int untracked = 0;
  };
  Choice Next(int64_t now_us, int64_t waiting_bytes);
  // The keyframe was taken, at so many bytes.
  void Charge(int64_t bytes) { debt_bytes_ += static_cast<double>(bytes); }

  int rung() const { return rung_; }
  double budget_bytes_per_s() const { return budget_; }

 private:
  void Change(int by);

  const double budget_;
  double debt_bytes_ = 0;
  int64_t last_us_ = 0;
  int rung_ = 0;
  int since_change_ = 0;  // keyframes
  double debt_at_change_ = 0;
  int since_corners_ = 1000;  // keyframes; the first has corners
};

}  // namespace pangea
