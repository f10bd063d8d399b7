#include "vio/live/stamp_check.h"

#include <gtest/gtest.h>

#include <limits>

namespace pangea::vio {
namespace {

using Decision = StampCheck::Decision;

constexpr int64_t kStep_us = 5'000;
constexpr int64_t kMaxStep_us = 300'000;
constexpr int64_t kNow = 1'700'000'000'000'000;

// Passes stamps at 200 Hz from `begin` on until one is accepted; returns how many were refused.
int RefusedUntilTaken(StampCheck* check, int64_t begin) {
  for (int i = 0; i < 1000; ++i) {
    const Decision result = check->Check(begin + i * kStep_us);
    if (result == Decision::kNext || result == Decision::kWentBack) {
      return i;
    }
  }
  return 1000;
}

TEST(StampCheck, OneFarAheadIsRefusedAndTheStreamGoesOn) {
  StampCheck check(kMaxStep_us);
  EXPECT_EQ(check.Check(kNow), Decision::kNext);
  EXPECT_EQ(check.Check(kNow + kMaxStep_us + 1), Decision::kFarAhead);
  EXPECT_EQ(check.Check(StampCheck::kMaxUtime), Decision::kFarAhead);
  EXPECT_EQ(check.Check(std::numeric_limits<int64_t>::max()), Decision::kOutOfRange);
  EXPECT_EQ(check.Check(std::numeric_limits<int64_t>::min()), Decision::kOutOfRange);
  EXPECT_EQ(check.Check(-StampCheck::kMaxUtime), Decision::kNotAfter);
  EXPECT_EQ(check.Check(kNow), Decision::kNotAfter);
  EXPECT_EQ(check.Check(kNow + kStep_us), Decision::kNext);
  EXPECT_EQ(check.Check(kNow + kStep_us + kMaxStep_us), Decision::kNext);
}

TEST(StampCheck, AFirstOneThatIsFarOffDoesNotBlockForEver) {
  for (const int64_t first : {StampCheck::kMaxUtime, kNow + 3'600'000'000, int64_t{0}}) {
    StampCheck check(kMaxStep_us);
    EXPECT_EQ(check.Check(first), Decision::kNext);
    EXPECT_EQ(RefusedUntilTaken(&check, kNow), kMaxStep_us / kStep_us + 1) << first;
    EXPECT_EQ(RefusedUntilTaken(&check, kNow + 310'000), 0);
  }
}

TEST(StampCheck, SaysWhenTheStreamWentBack) {
  StampCheck check(kMaxStep_us);
  check.Check(kNow);
  Decision result = Decision::kNext;
  for (int i = 0; i <= 61; ++i) {
    result = check.Check(i * kStep_us);
  }
  EXPECT_EQ(result, Decision::kWentBack);
  EXPECT_EQ(check.newest(), 61 * kStep_us);
}

// A bus may deliver a message twice.
TEST(StampCheck, RepeatsDoNotHinderNorHelp) {
  StampCheck check(kMaxStep_us);
  check.Check(kNow);
  int taken = 0;
  for (int i = 0; i <= 61; ++i) {
    taken += check.Check(i * kStep_us) == Decision::kWentBack ? 1 : 0;
    taken += check.Check(i * kStep_us) == Decision::kWentBack ? 1 : 0;
  }
  EXPECT_EQ(taken, 1);
  for (int i = 0; i < 1000; ++i) {
    EXPECT_EQ(check.Check(kNow), Decision::kFarAhead);
  }
}

// Two sources on one channel: the first one is kept.
TEST(StampCheck, WhatIsBetweenTakenOnesNeverAgrees) {
  StampCheck check(kMaxStep_us);
  for (int i = 0; i < 1000; ++i) {
    EXPECT_EQ(check.Check(kNow + i * kStep_us), Decision::kNext);
    EXPECT_EQ(check.Check(i * kStep_us), Decision::kNotAfter);
    EXPECT_EQ(check.Check(2 * kNow + i * kStep_us), Decision::kFarAhead);
  }
}

// A stamp that is ahead by no more than the allowed gap causes a loss of that time, but no restart.
TEST(StampCheck, OneALittleAheadIsCaughtUpWith) {
  StampCheck check(kMaxStep_us);
  check.Check(kNow);
  EXPECT_EQ(check.Check(kNow + kMaxStep_us), Decision::kNext);
  for (int64_t utime = kNow + kStep_us; utime <= kNow + kMaxStep_us; utime += kStep_us) {
    EXPECT_EQ(check.Check(utime), Decision::kNotAfter);
  }
  EXPECT_EQ(check.Check(kNow + kMaxStep_us + kStep_us), Decision::kNext);
}

}  // namespace
}  // namespace pangea::vio
