#include "cluster/outstanding_matches.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/server_messages.h"

namespace pangea {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

constexpr int64_t kSecond_us = 1'000'000;
const MapId kMap{1, 1000};

PlaceMatch Match(int32_t seq, int candidates) {
  PlaceMatch match;
  match.query = {kMap, seq};
  for (int i = 0; i < candidates; ++i) {
    match.candidates.push_back({{kMap, i}, PlaceKind::kIntra, 1.0f, {}});
  }
  return match;
}

int64_t Id(const PlaceMatch& match, size_t candidate) {
  return ConstraintId(match.query, match.candidates[candidate]);
}

TEST(OutstandingMatches, AMatchIsDoneWithTheLastOfItsResults) {
  OutstandingMatches outstanding;
  const PlaceMatch first = Match(10, 2), second = Match(11, 1);
  outstanding.Add(first, "ack 10", 0);
  outstanding.Add(second, "ack 11", 0);
  EXPECT_EQ(outstanding.num_lacking(), 3u);
  EXPECT_FALSE(outstanding.NoteStored(Id(first, 1)));
  EXPECT_FALSE(outstanding.NoteStored(Id(first, 1))) << "a double";
  EXPECT_FALSE(outstanding.NoteStored(Id(Match(12, 1), 0))) << "another worker's";
  EXPECT_TRUE(outstanding.Lacks(Id(first, 0)));
  EXPECT_FALSE(outstanding.Lacks(Id(first, 1)));
  EXPECT_EQ(outstanding.NoteStored(Id(first, 0)), "ack 10");
  EXPECT_THAT(outstanding.AckSubjects(), ElementsAre("ack 11"));
  EXPECT_EQ(outstanding.size(), 1u);
  EXPECT_EQ(outstanding.num_lacking(), 1u);
}

TEST(OutstandingMatches, WhatLacksIsOverdueEverMoreRarely) {
  OutstandingMatches outstanding;
  const PlaceMatch match = Match(10, 3);
  outstanding.Add(match, "ack", 0);
  outstanding.NoteStored(Id(match, 1));
  EXPECT_THAT(outstanding.Overdue(2 * kSecond_us), IsEmpty());
  const auto overdue = outstanding.Overdue(3 * kSecond_us);
  ASSERT_THAT(overdue, SizeIs(1));
  ASSERT_THAT(overdue[0].candidates, SizeIs(2));
  EXPECT_EQ(Id(overdue[0], 0), Id(match, 0));
  EXPECT_EQ(Id(overdue[0], 1), Id(match, 2));
  int times = 0;
  for (int64_t now_s = 4; now_s < 604; ++now_s) {
    times += outstanding.Overdue(now_s * kSecond_us).empty() ? 0 : 1;
  }
  EXPECT_GE(times, 10);
  EXPECT_LE(times, 14) << "once a minute in the end";
}

// When it was given to this worker again, as nothing had been said of it for too long.
TEST(OutstandingMatches, TheSameMatchAgainHasTheNewerAckSubject) {
  OutstandingMatches outstanding;
  const PlaceMatch match = Match(10, 1);
  outstanding.Add(match, "old", 0);
  outstanding.Add(match, "new", kSecond_us);
  EXPECT_EQ(outstanding.size(), 1u);
  EXPECT_EQ(outstanding.NoteStored(Id(match, 0)), "new");
  EXPECT_THAT(outstanding.AckSubjects(), IsEmpty());
}

// Another worker, which then fell silent, had stored one of its results.
TEST(OutstandingMatches, TheSameMatchAgainLacksOnlyWhatItLacksNow) {
  OutstandingMatches outstanding;
  const PlaceMatch before = Match(10, 2);
  PlaceMatch now = before;
  now.candidates.erase(now.candidates.begin());
  outstanding.Add(before, "old", 0);
  outstanding.Add(now, "new", kSecond_us);
  EXPECT_EQ(outstanding.num_lacking(), 1u);
  EXPECT_EQ(outstanding.NoteStored(Id(before, 1)), "new");
  EXPECT_FALSE(outstanding.NoteStored(Id(before, 0))) << "read from the stream afterwards";
  EXPECT_EQ(outstanding.num_lacking(), 0u);
}

}  // namespace
}  // namespace pangea
