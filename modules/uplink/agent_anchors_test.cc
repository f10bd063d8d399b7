#include "uplink/agent_anchors.h"

#include <gtest/gtest.h>

#include "messages/testing/test_anchors.h"
#include "uplink/test_ids.h"

namespace pangea {
namespace {

LinkAnchor Anchor(int64_t number, const AnchorId& id, int64_t revision = 1) {
  return {number, TestAnchor(id, revision, kMap)};
}

TEST(AgentAnchors, TheHighestNumberCountsAndAllAreConfirmed) {
  AgentAnchors anchors;
  EXPECT_EQ(anchors.Take(Anchor(5, kA, 2), 0), AgentAnchors::Taken::kNew);
  EXPECT_EQ(anchors.Take(Anchor(4, kA, 1), 0), AgentAnchors::Taken::kKnown) << "overtaken";
  EXPECT_EQ(anchors.Take(Anchor(5, kA, 2), 0), AgentAnchors::Taken::kKnown);
  EXPECT_EQ(anchors.TakeReceived(), (std::vector<int64_t>{5, 4, 5}));
  EXPECT_TRUE(anchors.TakeReceived().empty());
  const auto due = anchors.DueAgain(10'000'000);
  ASSERT_EQ(due.size(), 1u);
  EXPECT_EQ(due[0].revision, 2);
}

TEST(AgentAnchors, AnotherSessionNumbersAnew) {
  AgentAnchors anchors;
  anchors.Take(Anchor(900, kA, 1), 0);
  anchors.OnNewSession();
  EXPECT_TRUE(anchors.TakeReceived().empty()) << "numbers of the session before";
  EXPECT_EQ(anchors.Take(Anchor(1, kA, 2), 0), AgentAnchors::Taken::kNew);
}

TEST(AgentAnchors, AppsAreToldAgain) {
  AgentAnchors anchors;
  anchors.Take(Anchor(1, kA), 1'000'000);
  EXPECT_TRUE(anchors.DueAgain(10'999'999).empty());
  EXPECT_EQ(anchors.DueAgain(11'000'000).size(), 1u);
  EXPECT_TRUE(anchors.DueAgain(11'000'001).empty());
  anchors.Take(Anchor(2, kA, 2), 20'000'000);
  EXPECT_TRUE(anchors.DueAgain(21'000'001).empty()) << "told of the change";
}

TEST(AgentAnchors, IsBounded) {
  AgentAnchors anchors;
  int64_t number = 0;
  for (int i = 0; i < static_cast<int>(AgentAnchors::kMaxAnchors); ++i) {
    ASSERT_EQ(anchors.Take(Anchor(++number, {1, i}), 0), AgentAnchors::Taken::kNew);
  }
  EXPECT_EQ(anchors.TakeReceived().size(), kMaxAnchorsReceived);
  const AnchorId another{2, 1};
  EXPECT_FALSE(anchors.MakeRoomFor(TestAnchor(another, 1, kMap)));
  EXPECT_EQ(anchors.Take(Anchor(++number, another), 0), AgentAnchors::Taken::kFull);
  EXPECT_TRUE(anchors.TakeReceived().empty()) << "what is not kept is not confirmed";
  EXPECT_FALSE(anchors.MakeRoomFor(TestAnchor({1, 3}, 1, kMap))) << "it has room";
  // Deleted anchors make room first, then anchors that only an earlier session has sent.
  LinkAnchor gone = Anchor(++number, {1, 7}, 2);
  gone.state.gone = true;
  EXPECT_EQ(anchors.Take(gone, 0), AgentAnchors::Taken::kNew);
  EXPECT_EQ(anchors.MakeRoomFor(TestAnchor(another, 1, kMap))->anchor, (AnchorId{1, 7}));
  EXPECT_EQ(anchors.Take(Anchor(++number, another), 0), AgentAnchors::Taken::kNew);
  anchors.OnNewSession();
  anchors.Take(Anchor(1, {1, 0}), 0);
  EXPECT_EQ(anchors.MakeRoomFor(TestAnchor({3, 3}, 1, kMap))->anchor, (AnchorId{1, 1}));
}

TEST(AgentAnchors, AnchorsOfAnEarlierMapMakeRoom) {
  AgentAnchors anchors;
  int64_t number = 0;
  for (int i = 0; i < static_cast<int>(AgentAnchors::kMaxAnchors); ++i) {
    anchors.Take(Anchor(++number, {1, i}), 0);
  }
  const AnchorState later = TestAnchor({2, 1}, 1, kLaterMap);
  EXPECT_TRUE(anchors.MakeRoomFor(later));
  EXPECT_EQ(anchors.Take({++number, later}, 0), AgentAnchors::Taken::kNew);
}

}  // namespace
}  // namespace pangea
