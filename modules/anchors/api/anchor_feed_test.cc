#include "anchors/api/anchor_feed.h"

#include <gtest/gtest.h>

#include "core/testing/synthetic_world.h"

namespace pangea {
namespace {

using nlohmann::json;

class AnchorFeedTest : public testing::Test {
 protected:
  AnchorFeedTest() : anchors_(AnchorsOptions()), feed_(anchors_) {
    SyntheticWorldOptions options;
    options.num_keyframes = 10;
    options.num_agents = 1;
    options.with_corners = false;
    world_ = MakeSyntheticWorld(options);
    for (const Keyframe& keyframe : world_.agents[0].keyframes) {
      anchors_.Take(keyframe);
    }
  }

  void Edit(int64_t number, int64_t revision, bool deleted = false, int32_t seq = 5) {
    AnchorEdit edit;
    edit.anchor = {1, number};
    edit.revision = revision;
    edit.agent_id = 1;
    edit.right = AnchorRight::kEditOwn;
    edit.name = "revision " + std::to_string(revision);
    edit.deleted = deleted;
    edit.placement =
        revision == 1 ? AnchorEdit::Placement::kKeyframe : AnchorEdit::Placement::kSame;
    edit.map = world_.agents[0].map;
    edit.keyframe_seq = seq;
    ASSERT_EQ(anchors_.Take(edit), "");
  }
  void MoveMap(int64_t revision, double by_m) {
    MapState state;
    state.group = world_.agents[0].map;
    state.revision = revision;
    state.maps = {state.group};
    for (const Keyframe& keyframe : world_.agents[0].keyframes) {
      Rigid3 T = keyframe.T_odom_body;
      T.t.x() += by_m;
      state.keyframes.push_back({keyframe.id, keyframe.utime, T});
    }
    anchors_.Take(state);
  }
  void Later() { feed_.SetNow(now_utime_ += AnchorFeed::kInterval_us); }
  static std::vector<json> Take(AnchorListener& listener) {
    std::vector<json> said;
    while (const auto message = listener.Next()) {
      said.push_back(json::parse(*message));
    }
    return said;
  }

  SyntheticWorld world_;
  Anchors anchors_;
  AnchorFeed feed_;
  int64_t now_utime_ = 1'000'000;
};

TEST_F(AnchorFeedTest, AllAtFirstThenWhatChanges) {
  Edit(1, 1);
  Edit(2, 1);
  AnchorListener listener(feed_);
  ASSERT_EQ(Take(listener).size(), 2u);
  Later();
  EXPECT_EQ(Take(listener).size(), 0u);
  Edit(2, 2);
  EXPECT_EQ(Take(listener).size(), 0u) << "looked at every kInterval_us";
  Later();
  const auto said = Take(listener);
  ASSERT_EQ(said.size(), 1u);
  EXPECT_EQ(said[0]["type"], "anchor");
  EXPECT_EQ(said[0]["id"], "1/2");
  EXPECT_EQ(said[0]["name"], "revision 2");
}

TEST_F(AnchorFeedTest, ASlowListenerGetsTheNewestOnly) {
  Edit(1, 1);
  Edit(2, 1);
  AnchorListener listener(feed_);
  AnchorListener other(feed_);
  Take(listener);
  for (int64_t revision = 2; revision < 100; ++revision) {
    Edit(1, revision);
    Later();
    Take(other);
  }
  const auto said = Take(listener);
  ASSERT_EQ(said.size(), 1u);
  EXPECT_EQ(said[0]["revision"], 99);
}

TEST_F(AnchorFeedTest, MovesWithTheMapByMoreThanTheThreshold) {
  MoveMap(1, 0);
  Edit(1, 1);
  AnchorListener listener(feed_);
  const double x = Take(listener).at(0)["pose"]["position"][0];
  for (int64_t revision = 2; revision <= 5; ++revision) {  // 0.4 mm each: creeping is seen too
    MoveMap(revision, 0.0004 * static_cast<double>(revision));
    Later();
    EXPECT_TRUE(Take(listener).empty()) << revision;
  }
  MoveMap(6, 0.0024);
  Later();
  const auto said = Take(listener);
  ASSERT_EQ(said.size(), 1u);
  EXPECT_NEAR(said[0]["pose"]["position"][0].get<double>(), x + 0.0024, 1e-9);
}

TEST_F(AnchorFeedTest, GoneIsSaidToThoseWhoKnewIt) {
  Edit(1, 1);
  Edit(2, 1);
  AnchorListener before(feed_);
  Take(before);
  Edit(1, 2, true);
  Later();
  const auto said = Take(before);
  ASSERT_EQ(said.size(), 1u);
  EXPECT_EQ(said[0], (json{{"type", "gone"}, {"id", "1/1"}}));
  AnchorListener after(feed_);
  const auto all = Take(after);
  ASSERT_EQ(all.size(), 1u);
  EXPECT_EQ(all[0]["id"], "1/2");
}

TEST_F(AnchorFeedTest, OneThatWaitsForItsKeyframeHasNoPoseYet) {
  Edit(1, 1, false, 1000);
  AnchorListener listener(feed_);
  EXPECT_TRUE(Take(listener).at(0)["pose"].is_null());
  EXPECT_FALSE(listener.Receive("anything"));
}

}  // namespace
}  // namespace pangea
