#include "uplink/shown_anchors.h"

#include <gtest/gtest.h>

#include <functional>
#include <random>

#include "messages/testing/test_anchors.h"
#include "uplink/test_ids.h"

namespace pangea {
namespace {

constexpr double kMaxStep = 0.013, kMaxRotation = 0.0101;

AnchorState At(const Eigen::Vector3d& t, double angle = 0) {
  AnchorState state = TestAnchor(kA, 1, kMap, t);
  state.T_odom_anchor.q = ExpSo3({0, 0, angle});
  return state;
}

class Shown : public testing::Test {
 protected:
  void Run(double seconds, int64_t poll_us = 5000) {
    for (const int64_t end = now + static_cast<int64_t>(seconds * 1e6); now < end; now += poll_us) {
      const auto published = blend.Poll(now);
      if (!published) {
        continue;
      }
      ++count;
      if (last && published->anchors.size() == 1 && last->anchors.size() == 1) {
        const Vector6d step =
            published->anchors[0].T_odom_anchor.Minus(last->anchors[0].T_odom_anchor);
        largest_step = std::max(largest_step, step.head<3>().norm());
        largest_rotation = std::max(largest_rotation, step.tail<3>().norm());
      }
      last = published;
    }
  }
  double ErrorTo(const Eigen::Vector3d& t) const {
    return (last->anchors.at(0).T_odom_anchor.t - t).norm();
  }

  ShownAnchorsBlend blend;
  int64_t now = kSecond;
  std::optional<ShownAnchors> last;
  int count = 0;
  double largest_step = 0, largest_rotation = 0;
};

TEST_F(Shown, NothingBeforeAnAnchorAndAPose) {
  blend.OnPose(77, kMap);
  Run(2);
  EXPECT_EQ(count, 0);
  blend = {};
  blend.Set(At({1, 2, 3}));
  Run(2);
  EXPECT_EQ(count, 0);
}

TEST_F(Shown, ANewAnchorIsWhereItIs) {
  blend.OnPose(77, kMap);
  blend.Set(At({1, 2, 3}));
  Run(10);
  EXPECT_EQ(count, 10);
  EXPECT_EQ(last->utime, 77);
  EXPECT_EQ(last->map, kMap);
  EXPECT_EQ(last->anchors.at(0).revision, 1);
  EXPECT_EQ(ErrorTo({1, 2, 3}), 0);
  EXPECT_EQ(largest_step, 0);
}

TEST_F(Shown, ASmallCorrectionIsBlended) {
  blend.OnPose(77, kMap);
  blend.Set(At({1, 2, 3}));
  Run(2);
  blend.Set(At({1, 2, 3.05}));
  EXPECT_TRUE(blend.moving());
  count = 0;
  Run(0.4);
  EXPECT_GE(count, 7) << "20 Hz";
  EXPECT_GT(ErrorTo({1, 2, 3.05}), 0.005);
  Run(0.2);
  EXPECT_EQ(ErrorTo({1, 2, 3.05}), 0);
  EXPECT_FALSE(blend.moving());
  EXPECT_LE(largest_step, 0.0051) << "0.1 m/s";
  count = 0;
  Run(10);
  EXPECT_EQ(count, 10) << "1 Hz";
}

TEST_F(Shown, WithinThreeSecondsUpToItsSpeed) {
  blend.OnPose(77, kMap);
  for (const double way : {0.1, 0.3, 0.5, 0.67}) {
    const Eigen::Vector3d to = Eigen::Vector3d(1, 2, 3) + way * Eigen::Vector3d::UnitX();
    blend.Erase(kA);
    Run(0.1);
    blend.Set(At({1, 2, 3}));
    Run(2);
    blend.Set(At(to));
    Run(3, 4000);
    EXPECT_EQ(ErrorTo(to), 0) << way;
    EXPECT_LE(largest_step, kMaxStep) << way;
  }
}

TEST_F(Shown, NoStepIsLongHoweverLatePollComes) {
  std::mt19937_64 rng(3);
  std::uniform_real_distribution<double> unit(-1, 1);
  blend.OnPose(77, kMap);
  blend.Set(At({1, 2, 3}));
  Run(2);
  for (int i = 0; i < 300; ++i) {
    blend.Set(At({5 * unit(rng), 5 * unit(rng), 5 * unit(rng)}, 3 * unit(rng)));
    Run(unit(rng) + 1, 1000 + static_cast<int64_t>(rng() % 700'000));
  }
  EXPECT_LE(largest_step, kMaxStep);
  EXPECT_GE(largest_step, 0.012) << "and it does move";
  EXPECT_LE(largest_rotation, kMaxRotation);
  EXPECT_GE(largest_rotation, 0.009);
}

TEST_F(Shown, RotatesToItsPlace) {
  blend.OnPose(77, kMap);
  blend.Set(At({1, 2, 3}));
  Run(2);
  blend.Set(At({1, 2, 3}, 0.3));
  Run(1.3, 4000);
  EXPECT_TRUE(blend.moving());
  Run(0.5, 4000);
  EXPECT_FALSE(blend.moving());
  EXPECT_LE(largest_rotation, kMaxRotation);
  EXPECT_NEAR(YawOf(last->anchors.at(0).T_odom_anchor.q), 0.3, 1e-9);
}

TEST_F(Shown, CorrectionsOnItsWayDoNotSlowIt) {
  blend.OnPose(77, kMap);
  blend.Set(At({0, 0, 0}));
  Run(2);
  blend.Set(At({0.6, 0, 0}));
  for (int i = 0; i < 5; ++i) {
    Run(0.5, 4000);
    blend.Set(At({0.6 + 1e-4 * i, 0, 0}));
  }
  Run(0.5, 4000);
  EXPECT_LT(ErrorTo({0.6004, 0, 0}), 1e-9);
}

TEST_F(Shown, WhatPeopleMovedMayJump) {
  blend.OnPose(77, kMap);
  blend.Set(At({1, 2, 3}));
  Run(2);
  AnchorState moved = At({4, 2, 3});
  moved.revision = 2;
  blend.Set(moved);
  Run(0.1);
  EXPECT_EQ(ErrorTo({4, 2, 3}), 0);
  moved.edited_by = 9;
  moved.T_odom_anchor.t.x() = 7;
  blend.Set(moved);
  Run(0.1);
  EXPECT_EQ(ErrorTo({7, 2, 3}), 0);
}

TEST_F(Shown, AChangeOfItsNameOrPayloadIsNoJump) {
  blend.OnPose(77, kMap);
  blend.Set(At({1, 2, 3}));
  Run(2);
  blend.Set(At({1.5, 2, 3}));
  Run(0.5);
  AnchorState renamed = At({1.5015, 2, 3});
  renamed.revision = 2;
  blend.Set(renamed);
  Run(0.1);
  EXPECT_EQ(last->anchors.at(0).revision, 2);
  EXPECT_LE(largest_step, kMaxStep);
  Run(2.5, 4000);
  EXPECT_EQ(ErrorTo({1.5015, 2, 3}), 0);
}

TEST_F(Shown, OnlyThoseOfTheAgentsMap) {
  blend.OnPose(77, kMap);
  blend.Set(At({1, 2, 3}));
  AnchorState other = TestAnchor(kB, 1, kLaterMap, {9, 9, 9});
  blend.Set(other);
  Run(1.1);
  ASSERT_EQ(last->anchors.size(), 1u);
  EXPECT_EQ(last->anchors[0].anchor, kA);
  blend.OnPose(78, kLaterMap);
  Run(0.1);
  EXPECT_EQ(last->map, kLaterMap);
  ASSERT_EQ(last->anchors.size(), 1u);
  EXPECT_EQ(last->anchors[0].anchor, kB);
  blend.Set(At({2, 2, 3}));
  EXPECT_FALSE(blend.moving()) << "nobody sees it";
  AnchorState brought = At({-5, 0, 0});
  brought.map = kLaterMap;
  blend.Set(brought);
  Run(0.1);
  ASSERT_EQ(last->anchors.size(), 2u);
  EXPECT_EQ(ErrorTo({-5, 0, 0}), 0);
}

TEST_F(Shown, WhatIsGoneIsNotShown) {
  blend.OnPose(77, kMap);
  blend.Set(At({1, 2, 3}));
  Run(1.1);
  AnchorState gone = At({1, 2, 3});
  gone.gone = true;
  blend.Set(gone);
  Run(0.1);
  EXPECT_TRUE(last->anchors.empty());
  blend.Set(At({2, 2, 3}));
  Run(0.1);
  EXPECT_EQ(ErrorTo({2, 2, 3}), 0) << "new again";
}

TEST_F(Shown, KeyframesStandInWhereThereIsNoPose) {
  blend.Set(At({1, 2, 3}));
  blend.OnKeyframe(50, kMap);
  Run(1.1);
  EXPECT_EQ(last->utime, 50);
  blend.OnKeyframe(60, kLaterMap);
  blend.OnKeyframe(70, kMap);  // retransmitted
  Run(1.1);
  EXPECT_EQ(last->map, kLaterMap);
  blend.OnPose(40, kMap);
  blend.OnKeyframe(80, kLaterMap);
  Run(1.1);
  EXPECT_EQ(last->map, kMap);
  EXPECT_EQ(last->utime, 40);
}

}  // namespace
}  // namespace pangea
