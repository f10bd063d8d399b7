#include "uplink/ladder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace pangea {
namespace {

constexpr int64_t kSecond = 1'000'000;

// As measured: bytes of a compressed keyframe.
int64_t Size(const RateLadder::Choice& choice) {
  return choice.bare ? 1'500 : 1'500 + 40 * (110 + std::min(choice.untracked, 450));
}

struct Walk {
  double bytes_per_s = 0;
  int lowest = RateLadder::kNumRungs, highest = 0;  // in the second half
  int longest_without_corners = 0;
  int changes = 0;
};

Walk WalkFor(double budget, int64_t waiting_bytes = 0) {
  constexpr int kKeyframes = 400;
  constexpr int64_t kInterval_us = 500'000;
  RateLadder ladder(budget);
  Walk walk;
  int without = 0;
  for (int i = 0; i < kKeyframes; ++i) {
    const int before = ladder.rung();
    const auto choice = ladder.Next(kSecond + i * kInterval_us, waiting_bytes);
    ladder.Charge(Size(choice));
    without = choice.bare ? without + 1 : 0;
    walk.longest_without_corners = std::max(walk.longest_without_corners, without);
    if (i >= kKeyframes / 2) {
      walk.bytes_per_s += static_cast<double>(Size(choice));
      walk.lowest = std::min(walk.lowest, ladder.rung());
      walk.highest = std::max(walk.highest, ladder.rung());
      walk.changes += ladder.rung() != before ? 1 : 0;
    }
  }
  walk.bytes_per_s /= 1e-6 * static_cast<double>(kKeyframes / 2 * kInterval_us);
  return walk;
}

TEST(RateLadder, LeavesNothingOutOfWhatFits) {
  const Walk walk = WalkFor(70e3);
  EXPECT_EQ(walk.highest, 0);
  EXPECT_EQ(walk.longest_without_corners, 0);
}

// All budgets a link may have: kept, and used.
TEST(RateLadder, KeepsEveryBudgetAndUsesIt) {
  for (const double budget : {40e3, 30e3, 20e3, 15e3, 10e3, 8e3}) {
    const Walk walk = WalkFor(budget);
    EXPECT_LE(walk.bytes_per_s, 0.87 * budget) << budget;
    EXPECT_GE(walk.bytes_per_s, 0.70 * budget) << budget;
    EXPECT_LE(walk.highest - walk.lowest, 3) << budget;
    EXPECT_LE(walk.changes, 200 / 5) << budget << ": restless";
  }
}

TEST(RateLadder, ThinsBeforeItLeavesCornersOutAltogether) {
  EXPECT_EQ(WalkFor(25e3).longest_without_corners, 0);
  EXPECT_GT(WalkFor(8e3).longest_without_corners, 0);
  EXPECT_LE(WalkFor(1e3).longest_without_corners, 3);
}

TEST(RateLadder, LeavesRoomForWhatWaits) {
  EXPECT_LE(WalkFor(20e3, 1'000'000).bytes_per_s, 0.62 * 20e3);
}

TEST(RateLadder, AStandstillIsNotSavedUp) {
  RateLadder ladder(10e3);
  ladder.Next(kSecond, 0);
  ladder.Next(1000 * kSecond, 0);
  int64_t bytes = 0;
  for (int i = 0; i < 20; ++i) {
    const auto choice = ladder.Next(1000 * kSecond + i * 100'000, 0);
    bytes += Size(choice);
    ladder.Charge(Size(choice));
  }
  EXPECT_LE(bytes, 120'000) << "20 full keyframes would be 480 kB";
}

}  // namespace
}  // namespace pangea
