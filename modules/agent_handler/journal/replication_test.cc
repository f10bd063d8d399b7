#include "agent_handler/journal/replication.h"

#include <gtest/gtest.h>

namespace pangea {
namespace {

const MapId kReplicatedMap{3, 1'700'000'000'000'000};

Replication::Group GroupOf(int64_t journal_bytes, int32_t seq) {
  return {journal_bytes, {{kReplicatedMap, seq}}, seq};
}

TEST(Replication, WithoutOtherHostsWhatTheDiskHasIsKept) {
  Replication replication(false, 1000);
  EXPECT_TRUE(replication.Works(0));
  replication.Add(GroupOf(2000, 1));
  EXPECT_EQ(replication.TakeKept().size(), 1u);
  EXPECT_FALSE(replication.Awaits(kReplicatedMap.agent_id));
}

TEST(Replication, WhatOthersHaveIsKeptAndNothingBeyond) {
  Replication replication(true, 1000);
  replication.Add(GroupOf(2000, 1));
  replication.Add(GroupOf(3000, 2));
  EXPECT_TRUE(replication.TakeKept().empty());
  replication.OnReplicated(2999, 0);
  const auto kept = replication.TakeKept();
  ASSERT_EQ(kept.size(), 1u);
  EXPECT_EQ(kept.front().num_edits, 1);
  EXPECT_TRUE(replication.Awaits(kReplicatedMap.agent_id));
  EXPECT_FALSE(replication.Awaits(kReplicatedMap.agent_id + 1));
  replication.OnReplicated(2000, 0);
  EXPECT_TRUE(replication.TakeKept().empty()) << "an older one";
  replication.OnReplicated(3000, 0);
  EXPECT_EQ(replication.TakeKept().size(), 1u);
  EXPECT_FALSE(replication.Awaits(kReplicatedMap.agent_id));
}

TEST(Replication, WorksOnceTheStartIsReplicatedUntilTheBridgeIsSilent) {
  Replication replication(true, 1000);
  EXPECT_FALSE(replication.Works(0));
  replication.OnReplicated(999, 0);
  EXPECT_FALSE(replication.Works(0));
  replication.OnReplicated(1000, 5'000'000);
  EXPECT_TRUE(replication.Works(5'000'000));
  EXPECT_TRUE(replication.Works(5'000'000 + Replication::kLongestSilence_us - 1));
  EXPECT_FALSE(replication.Works(5'000'000 + Replication::kLongestSilence_us));
}

}  // namespace
}  // namespace pangea
