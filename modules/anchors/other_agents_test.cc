// Poses of other agents in the synthetic world.

#include "anchors/other_agents.h"

#include <gtest/gtest.h>

#include "anchors/anchors_test_world.h"

namespace pangea {
namespace {

constexpr int64_t kNow = 1'700'000'000'000'000;
constexpr int kSeq = 15;

class OtherAgentsTest : public AnchorsTestWorld {
 protected:
  const Keyframe& Newest(int agent) const { return world_.agents[agent].keyframes[kSeq]; }
  void Hear(int agent, int64_t utime) {
    others_.Take(map(agent), Newest(agent).T_odom_body, utime);
  }

  OtherAgents others_;
};

TEST_F(OtherAgentsTest, EachHasTheOthersInItsOwnOdomFrame) {
  Fuse();
  Hear(0, kNow);
  Hear(1, kNow);
  const std::vector<Others> for_each = others_.ForEach(anchors_, kNow);
  ASSERT_EQ(for_each.size(), 2u);
  for (const int self : {0, 1}) {
    const Others& others = for_each[self];
    EXPECT_EQ(others.map, world_.agents[self].map);
    ASSERT_EQ(others.others.size(), 1u);
    EXPECT_EQ(others.others[0].agent_id, world_.agents[1 - self].map.agent_id);
    // The other agent's pose relative to its own is the true one.
    const Rigid3 seen = Newest(self).T_odom_body.Inverse() * others.others[0].T_odom_cam;
    const Rigid3 truth = world_.T_hall_body(Newest(self).id).Inverse() *
                         world_.T_hall_body(Newest(1 - self).id) *
                         Newest(1 - self).camera.T_body_cam;
    // The odometry drifts by centimetres from here to the newest keyframe.
    EXPECT_LT((seen.t - truth.t).norm(), 0.1);
    EXPECT_LT(LogSo3(seen.q.conjugate() * truth.q).norm(), 0.02);
  }
}

TEST_F(OtherAgentsTest, NobodyOfAnotherGroupOrWhoWasHeardLongAgo) {
  Hear(0, kNow);
  Hear(1, kNow);
  EXPECT_TRUE(others_.ForEach(anchors_, kNow).empty());  // two maps that are alone
  Fuse();
  EXPECT_EQ(others_.ForEach(anchors_, kNow).size(), 2u);
  Hear(0, kNow + OtherAgents::kFresh_us);
  EXPECT_TRUE(others_.ForEach(anchors_, kNow + OtherAgents::kFresh_us + 1).empty());
}

TEST_F(OtherAgentsTest, AMapOfWhichNothingIsKnownYetIsLeftOut) {
  Fuse();
  Hear(0, kNow);
  others_.Take({2, 12345}, {}, kNow);  // a new one, without keyframes
  EXPECT_TRUE(others_.ForEach(anchors_, kNow).empty());
}

TEST_F(OtherAgentsTest, OfACrowdTheNearest) {
  MapState state;
  state.group = {100, 1};
  state.revision = 1;
  Keyframe keyframe = Newest(0);
  for (int32_t i = 0; i < 40; ++i) {
    keyframe.id = {{100 + i, 1}, 0};
    keyframe.edge.reset();
    anchors_.Take(keyframe);
    state.maps.push_back(keyframe.id.map);
    state.keyframes.push_back({keyframe.id, keyframe.utime, keyframe.T_odom_body});
    Rigid3 T_odom_body = keyframe.T_odom_body;
    T_odom_body.t.x() += i;
    others_.Take(keyframe.id.map, T_odom_body, kNow);
  }
  anchors_.Take(state);
  const std::vector<Others> for_each = others_.ForEach(anchors_, kNow);
  ASSERT_EQ(for_each.size(), 40u);
  ASSERT_EQ(for_each[0].others.size(), kMaxOthers);
  EXPECT_EQ(for_each[0].others[0].agent_id, 101);
  EXPECT_EQ(for_each[0].others.back().agent_id, 100 + static_cast<int32_t>(kMaxOthers));
}

}  // namespace
}  // namespace pangea
