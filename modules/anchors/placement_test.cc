// Anchors placed in a synthetic world's keyframes, whose odometry does not drift here.

#include "anchors/placement.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/testing/synthetic_world.h"
#include "core/testing/test_record_store.h"

namespace pangea {
namespace {

using Placement = AnchorEdit::Placement;

class PlacementTest : public testing::Test {
 protected:
  PlacementTest() {
    SyntheticWorldOptions options;
    options.num_agents = 1;
    options.num_keyframes = 30;
    options.edge_sigma_m = options.edge_sigma_yaw = options.tilt_sigma = 1e-6;
    world_ = MakeSyntheticWorld(options);
    for (const Keyframe& keyframe : agent().keyframes) {
      track_.Add(keyframe);
    }
    T_odom_hall_ = agent().keyframes[0].T_odom_body * agent().T_hall_body[0].Inverse();
  }

  const SyntheticAgent& agent() const { return world_.agents[0]; }
  AnchorEdit Edit(Placement placement, int seq) const {
    AnchorEdit edit;
    edit.placement = placement;
    edit.map = agent().map;
    edit.keyframe_seq = seq;
    edit.utime = agent().keyframes[seq].utime;
    return edit;
  }
  // Position of the anchor by its holds and the odometry's poses.
  static std::vector<Eigen::Vector3d> Positions(const OdometryTrack& track,
                                                const AnchorPlacement& placement) {
    std::vector<Eigen::Vector3d> positions;
    for (const Hold& hold : placement.holds) {
      positions.push_back((track.Find(hold.seq)->T_odom_body * hold.T_body_anchor).t);
    }
    return positions;
  }

  SyntheticWorld world_;
  OdometryTrack track_;
  Rigid3 T_odom_hall_;
};

TEST_F(PlacementTest, RelativeToAKeyframe) {
  AnchorEdit edit = Edit(Placement::kKeyframe, 10);
  edit.T_ref_anchor = {Eigen::Quaterniond::Identity(),
                       agent().keyframes[10].camera.T_body_cam * Eigen::Vector3d(0, 0, 2)};
  const auto result = Place(edit, track_, 8);
  const auto& placement = std::get<AnchorPlacement>(result);
  EXPECT_EQ(placement.holds.size(), 8u);
  double weights = 0;
  for (const Hold& hold : placement.holds) {
    weights += hold.weight;
  }
  EXPECT_NEAR(weights, 1, 1e-12);
  const Eigen::Vector3d expected = agent().keyframes[10].T_odom_body * edit.T_ref_anchor.t;
  for (const Eigen::Vector3d& p_odom : Positions(track_, placement)) {
    EXPECT_LT((p_odom - expected).norm(), 1e-9);
  }
}

TEST_F(PlacementTest, TheKeyframesThatSeeItHoldIt) {
  AnchorEdit edit = Edit(Placement::kKeyframe, 10);
  const CameraModel& camera = agent().keyframes[10].camera;
  edit.T_ref_anchor.t = camera.T_body_cam * Eigen::Vector3d(0, 0, 3);
  const auto result = Place(edit, track_, 4);
  const Eigen::Vector3d p_odom = agent().keyframes[10].T_odom_body * edit.T_ref_anchor.t;
  for (const Hold& hold : std::get<AnchorPlacement>(result).holds) {
    const Keyframe& keyframe = agent().keyframes[hold.seq];
    const auto pixel = camera.Project(keyframe.T_odom_cam().Inverse() * p_odom);
    EXPECT_TRUE(pixel && camera.Contains(*pixel)) << "keyframe " << hold.seq;
  }
}

// The keyframes up to 10 look away, and no odometry leads to those that see the anchor: it belongs
// to the keyframe that it was placed at.
TEST_F(PlacementTest, NoKeyframeBeyondAGapHoldsIt) {
  OdometryTrack track;
  for (Keyframe keyframe : agent().keyframes) {
    if (keyframe.id.seq <= 10) {
      keyframe.T_odom_body.q = YawRotation(std::numbers::pi) * keyframe.T_odom_body.q;
    } else if (keyframe.id.seq == 11) {
      keyframe.edge.reset();
    }
    track.Add(keyframe);
  }
  const Keyframe& beyond = agent().keyframes[12];
  const Eigen::Vector3d p_odom = beyond.T_odom_cam() * Eigen::Vector3d(0, 0, 3);
  AnchorEdit edit = Edit(Placement::kKeyframe, 10);
  edit.T_ref_anchor.t = track.Find(10)->T_odom_body.Inverse() * p_odom;
  const auto result = Place(edit, track, 8);
  const auto& placement = std::get<AnchorPlacement>(result);
  ASSERT_EQ(placement.holds.size(), 1u);
  EXPECT_EQ(placement.holds[0].seq, 10);
  EXPECT_EQ(placement.holds[0].weight, 1);
  EXPECT_LT((Positions(track, placement)[0] - p_odom).norm(), 1e-9);
}

// On corners with a map point: the anchor is at the world's point.
TEST_F(PlacementTest, OnTheSurfaceBehindAPixel) {
  std::vector<double> errors;
  int not_placed = 0;
  for (int seq = 8; seq < 22; ++seq) {
    const Keyframe& keyframe = agent().keyframes[seq];
    for (size_t i = 0; i < keyframe.points.size(); i += 5) {
      AnchorEdit edit = Edit(Placement::kPixel, seq);
      const int corner = keyframe.points[i].corner;
      edit.pixel = keyframe.corners[corner].pixel.cast<double>();
      const auto result = Place(edit, track_, 8);
      const auto* const placement = std::get_if<AnchorPlacement>(&result);
      if (placement == nullptr) {
        ++not_placed;
        continue;
      }
      const Eigen::Vector3d truth =
          T_odom_hall_ * world_.points[agent().point_of_corner[seq][corner]].p_hall;
      const Eigen::Vector3d p_odom = Positions(track_, *placement)[0];
      errors.push_back((p_odom - truth).norm() / (truth - keyframe.T_odom_body.t).norm());
    }
  }
  ASSERT_GT(errors.size(), 60u);
  EXPECT_LT(not_placed, 40);
  std::ranges::sort(errors);
  // The depths have 3 % of noise, and boxes stand before the walls.
  EXPECT_LT(errors[errors.size() / 2], 0.03);
}

// The image's pose is that of its first row.
TEST_F(PlacementTest, ThePixelOfARollingShutterIsSeenWhenItsRowIs) {
  OdometryTrack track;
  for (Keyframe keyframe : agent().keyframes) {
    keyframe.camera.readout_s = 0.03;
    track.Add(keyframe);
  }
  const Keyframe& keyframe = agent().keyframes[12];
  const CameraModel& camera = keyframe.camera;
  AnchorEdit edit = Edit(Placement::kPixel, 12);
  int placed = 0;
  for (size_t i = 0; i < keyframe.points.size(); ++i) {
    edit.T_odom_body = i % 2 == 0 ? track.Between(edit.utime) : std::nullopt;
    edit.pixel = keyframe.corners[keyframe.points[i].corner].pixel.cast<double>();
    const auto result = Place(edit, track, 1);
    if (const auto* const placement = std::get_if<AnchorPlacement>(&result)) {
      ++placed;
      const double row_us = 30'000 * edit.pixel.y() / (camera.height - 1);
      const Rigid3 T_odom_cam =
          *track.Between(edit.utime + std::llround(row_us)) * camera.T_body_cam;
      const auto pixel = camera.Project(T_odom_cam.Inverse() * Positions(track, *placement)[0]);
      ASSERT_TRUE(pixel);
      EXPECT_LT((*pixel - edit.pixel).norm(), 1e-3);
    }
  }
  EXPECT_GT(placed, 5);
}

TEST_F(PlacementTest, OnASurfaceItStandsUprightAndFacesTheViewer) {
  const Keyframe& keyframe = agent().keyframes[12];
  AnchorEdit edit = Edit(Placement::kPixel, 12);
  edit.pixel = keyframe.corners[keyframe.points[20].corner].pixel.cast<double>();
  const auto result = Place(edit, track_, 1);
  const auto& placement = std::get<AnchorPlacement>(result);
  const Rigid3 T_odom_anchor =
      track_.Find(placement.holds[0].seq)->T_odom_body * placement.holds[0].T_body_anchor;
  EXPECT_LT((T_odom_anchor.q * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitZ()).norm(), 1e-9);
  const Eigen::Vector3d viewer = T_odom_anchor.Inverse() * keyframe.T_odom_cam().t;
  EXPECT_NEAR(viewer.y(), 0, 1e-6);
  EXPECT_GT(viewer.x(), 0);
}

TEST_F(PlacementTest, BetweenKeyframesUnlessThePoseIsSaid) {
  AnchorEdit edit = Edit(Placement::kBody, 10);
  edit.utime = (agent().keyframes[10].utime + agent().keyframes[11].utime) / 2;
  edit.T_ref_anchor.t = {1, 0, 0};
  const auto between = Place(edit, track_, 1);
  const Eigen::Vector3d middle = Positions(track_, std::get<AnchorPlacement>(between))[0];
  EXPECT_LT((middle - track_.Between(edit.utime).value() * Eigen::Vector3d(1, 0, 0)).norm(), 1e-9);
  edit.T_odom_body = Rigid3(Eigen::Quaterniond::Identity(), {5, 6, 7});
  const auto said = Place(edit, track_, 1);
  EXPECT_LT(
      (Positions(track_, std::get<AnchorPlacement>(said))[0] - Eigen::Vector3d(6, 6, 7)).norm(),
      1e-9);
}

TEST_F(PlacementTest, WaitsForWhatIsStillToCome) {
  AnchorEdit edit = Edit(Placement::kKeyframe, 10);
  edit.keyframe_seq = 30;
  EXPECT_TRUE(std::holds_alternative<AwaitsKeyframe>(Place(edit, track_, 8)));
  AnchorEdit later = Edit(Placement::kPixel, 29);
  later.utime += 1;
  EXPECT_TRUE(std::holds_alternative<AwaitsKeyframe>(Place(later, track_, 8)));
  EXPECT_TRUE(std::holds_alternative<AwaitsKeyframe>(Place(later, OdometryTrack(), 8)));
}

// Of a map that has ended, the keyframes before the edit are all that there will be.
TEST_F(PlacementTest, AfterTheLastKeyframeOfAMapThatHasEnded) {
  const Keyframe& last = agent().keyframes.back();
  AnchorEdit edit = Edit(Placement::kPixel, last.id.seq);
  edit.utime += 200'000;
  edit.pixel = last.corners[last.points[10].corner].pixel.cast<double>();
  EXPECT_TRUE(std::holds_alternative<AwaitsKeyframe>(Place(edit, track_, 8, true))) << "no pose";
  edit.T_odom_body = last.T_odom_body;
  EXPECT_TRUE(std::holds_alternative<AwaitsKeyframe>(Place(edit, track_, 8)));
  AnchorEdit at_the_last = edit;
  at_the_last.utime = last.utime;
  const auto result = Place(edit, track_, 8, true), expected = Place(at_the_last, track_, 8);
  EXPECT_LT((Positions(track_, std::get<AnchorPlacement>(result))[0] -
             Positions(track_, std::get<AnchorPlacement>(expected))[0])
                .norm(),
            0.01);
  edit.utime = last.utime + kPlacementReach_us + 1;
  EXPECT_TRUE(std::holds_alternative<AwaitsKeyframe>(Place(edit, track_, 8, true)));
}

TEST_F(PlacementTest, ThePixelOfARollingShutterIsSeenInTheLastKeyframeOfAMap) {
  OdometryTrack track;
  for (Keyframe keyframe : agent().keyframes) {
    keyframe.camera.readout_s = 0.03;
    track.Add(keyframe);
  }
  const Keyframe& last = agent().keyframes.back();
  AnchorEdit edit = Edit(Placement::kPixel, last.id.seq);
  edit.pixel = last.corners[last.points[10].corner].pixel.cast<double>();
  EXPECT_TRUE(std::holds_alternative<AwaitsKeyframe>(Place(edit, track, 8)));
  EXPECT_TRUE(std::holds_alternative<AnchorPlacement>(Place(edit, track, 8, true)));
}

TEST_F(PlacementTest, SaysWhyNot) {
  AnchorEdit before = Edit(Placement::kBody, 0);
  before.utime -= 1;
  EXPECT_TRUE(std::holds_alternative<NotPlaced>(Place(before, track_, 8)));
  AnchorEdit beyond = Edit(Placement::kPixel, 10);
  beyond.pixel = {1e5, 1e5};
  EXPECT_TRUE(std::holds_alternative<NotPlaced>(Place(beyond, track_, 8)));
}

// With points in a record store, half of them in memory for lack of room, the placement is the
// same.
TEST_F(PlacementTest, TheSameWithPointsSetAside) {
  test::TestRecordStore records(agent().keyframes.size() / 2);
  OdometryTrack track(&records);
  for (const Keyframe& keyframe : agent().keyframes) {
    track.Add(keyframe);
  }
  EXPECT_EQ(records.size(), agent().keyframes.size() / 2);
  EXPECT_EQ(track.counters().in_memory, std::ssize(agent().keyframes) / 2);
  const auto place = [&](int seq, const OdometryTrack& by) {
    AnchorEdit edit = Edit(Placement::kPixel, seq);
    const Keyframe& keyframe = agent().keyframes[seq];
    edit.pixel = keyframe.corners[keyframe.points[10].corner].pixel.cast<double>();
    return Place(edit, by, 8);
  };
  for (const int seq : {4, 14, 25}) {
    EXPECT_EQ(Positions(track, std::get<AnchorPlacement>(place(seq, track))),
              Positions(track_, std::get<AnchorPlacement>(place(seq, track_))));
  }

  records.broken = true;
  EXPECT_TRUE(std::holds_alternative<NotPlaced>(place(4, track)));
  EXPECT_GT(track.counters().unreadable, 0);
}

// A cubic through positions and velocities is exact for motion under constant jerk.
TEST(OdometryTrack, BetweenIsExactForACubic) {
  OdometryTrack track;
  const auto position = [](double t) { return Eigen::Vector3d(t * t * t, 2 * t * t, -t); };
  for (int i = 0; i < 2; ++i) {
    Keyframe keyframe;
    keyframe.id.seq = i;
    keyframe.utime = 500'000 * i;
    const double t = 0.5 * i;
    keyframe.T_odom_body.t = position(t);
    keyframe.v_odom_body = {3 * t * t, 4 * t, -1};
    track.Add(keyframe);
  }
  for (const double t : {0.1, 0.25, 0.4}) {
    const auto between = track.Between(static_cast<int64_t>(1e6 * t));
    ASSERT_TRUE(between);
    EXPECT_LT((between->t - position(t)).norm(), 1e-9);
  }
  EXPECT_FALSE(track.Between(-1));
  EXPECT_FALSE(track.Between(500'001));
}

}  // namespace
}  // namespace pangea
