#include "link/repeat_queue.h"

#include <gtest/gtest.h>

#include <map>

namespace pangea {
namespace {

constexpr AnchorId kA{1, 1}, kB{1, 2};
constexpr double kPlenty = 1e9;

TEST(RepeatQueue, RepeatsUntilConfirmed) {
  RepeatQueue queue(kPlenty);
  EXPECT_FALSE(queue.Next(0));
  queue.Add(kA);
  EXPECT_EQ(queue.Next(1'000'000), kA);
  EXPECT_FALSE(queue.Next(1'299'999));
  EXPECT_EQ(queue.Next(1'300'000), kA);
  queue.Remove(kA);
  EXPECT_FALSE(queue.Next(9'000'000));
  EXPECT_EQ(queue.size(), 0u);
}

TEST(RepeatQueue, WhatIsNewOrOfANewSessionGoesAtOnce) {
  RepeatQueue queue(kPlenty);
  queue.Add(kA);
  EXPECT_EQ(queue.Next(1'000'000), kA);
  queue.Add(kA);
  EXPECT_EQ(queue.Next(1'000'001), kA);
  EXPECT_FALSE(queue.Next(1'000'002));
  queue.SendAllAgain();
  EXPECT_EQ(queue.Next(1'000'003), kA);
  EXPECT_EQ(queue.size(), 1u);
}

TEST(RepeatQueue, KeepsItsRate) {
  RepeatQueue queue(4000);
  queue.Add(kA);
  queue.Add(kB);
  int64_t bytes = 0;
  for (int64_t now = 0; now < 60'000'000; now += 4000) {
    while (queue.Next(now)) {
      queue.Charge(1400);
      bytes += 1400;
    }
  }
  EXPECT_LE(bytes, 60 * 4000 + 4000 + 1400);
  EXPECT_GE(bytes, 59 * 4000);
}

// All values change and are confirmed faster than the rate allows: each is sent in rotation.
TEST(RepeatQueue, NoneWaitsForEver) {
  constexpr int kAnchors = 100;
  RepeatQueue queue(4000);
  std::map<int64_t, int> sent;
  for (int64_t now = 0; now < 100'000'000; now += 20'000) {
    for (int i = 0; i < kAnchors; ++i) {
      queue.Add({1, i});
    }
    while (const auto id = queue.Next(now)) {
      queue.Charge(400);
      queue.Remove(*id);
      ++sent[id->created_utime];
    }
  }
  ASSERT_EQ(sent.size(), size_t{kAnchors});
  for (const auto& [created_utime, times] : sent) {
    EXPECT_GE(times, 9) << created_utime;
    EXPECT_LE(times, 11) << created_utime;
  }
}

}  // namespace
}  // namespace pangea
