#include "agent_handler/anchor_table.h"

#include <gtest/gtest.h>

#include "messages/encoding.h"
#include "messages/testing/test_anchors.h"

namespace pangea {
namespace {

constexpr AnchorId kA{2, 1}, kB{2, 2};
constexpr MapId kAnchorMap{1, 1000};

class AnchorTableTest : public testing::Test {
 protected:
  bool Set(const AnchorId& id, int64_t revision, bool gone = false, const MapId& map = kAnchorMap) {
    AnchorState state = TestAnchor(id, revision, map);
    state.gone = gone;
    return table.Set(state, EncodeMessage(ToMessage(state)));
  }
  // The anchors that the table sends now.
  std::vector<LinkAnchor> Sent() {
    std::vector<LinkAnchor> sent;
    while (const auto body = table.Next(now)) {
      sent.push_back(ParseAnchor(1, *body).value.value());
    }
    return sent;
  }
  AnchorTable table;
  int64_t now = 1'000'000;
};

TEST_F(AnchorTableTest, SendsUntilConfirmed) {
  ASSERT_TRUE(Set(kA, 1));
  auto sent = Sent();
  ASSERT_EQ(sent.size(), 1u);
  EXPECT_EQ(sent[0].number, 1);
  EXPECT_TRUE(Sent().empty());
  now += 300'000;
  EXPECT_EQ(Sent().size(), 1u);
  table.OnReceived({7});
  EXPECT_EQ(table.unconfirmed(), 1u);
  table.OnReceived({1, 1});
  EXPECT_EQ(table.unconfirmed(), 0u);
  now += 10'000'000;
  EXPECT_TRUE(Sent().empty());
  ASSERT_TRUE(Set(kA, 1));
  EXPECT_TRUE(Sent().empty()) << "nothing new";
}

TEST_F(AnchorTableTest, OnlyTheNewestStateIsSentAndConfirmed) {
  Set(kA, 1);
  EXPECT_EQ(Sent().at(0).number, 1);
  Set(kA, 2);
  const auto sent = Sent();
  ASSERT_EQ(sent.size(), 1u);
  EXPECT_EQ(sent[0].number, 2);
  EXPECT_EQ(sent[0].state.revision, 2);
  table.OnReceived({1});
  EXPECT_EQ(table.unconfirmed(), 1u) << "that was the older one";
  table.OnReceived({2});
  EXPECT_EQ(table.unconfirmed(), 0u);
}

TEST_F(AnchorTableTest, AnotherSessionGetsAllAgain) {
  Set(kA, 1);
  Set(kB, 1);
  EXPECT_EQ(Sent().size(), 2u);
  table.OnReceived({1});
  table.OnNewSession();
  EXPECT_EQ(Sent().size(), 2u);
  table.OnReceived({1, 2});
  EXPECT_EQ(table.unconfirmed(), 0u);
}

TEST_F(AnchorTableTest, HoldsABoundedNumberOfAnchors) {
  for (int i = 0; i < static_cast<int>(AnchorTable::kMaxAnchors); ++i) {
    ASSERT_TRUE(Set({2, i}, 1));
  }
  EXPECT_FALSE(Set({3, 0}, 1));
  EXPECT_TRUE(Set({2, 0}, 2, true));
  EXPECT_FALSE(Set({3, 0}, 1)) << "its agent does not know yet";
  table.OnReceived({static_cast<int64_t>(AnchorTable::kMaxAnchors) + 1});
  EXPECT_TRUE(Set({3, 0}, 1));
  EXPECT_EQ(table.size(), AnchorTable::kMaxAnchors);
}

// A person's phone opens map after map, and hears of other anchors in each.
TEST_F(AnchorTableTest, AnchorsOfAMapThatTheAgentHasLeftMakeRoom) {
  for (int i = 0; i < static_cast<int>(AnchorTable::kMaxAnchors); ++i) {
    ASSERT_TRUE(Set({2, i}, 1));
  }
  ASSERT_TRUE(Set({3, 0}, 1, false, {1, 2000}));
  EXPECT_EQ(table.size(), AnchorTable::kMaxAnchors);
  EXPECT_EQ(table.unconfirmed(), AnchorTable::kMaxAnchors);
  table.OnNewSession();
  EXPECT_EQ(table.unconfirmed(), AnchorTable::kMaxAnchors);
}

}  // namespace
}  // namespace pangea
