// Refusals, with their reasons: look-alikes, and candidates with too little information.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <iostream>
#include <map>
#include <random>

#include "core/testing/test_descriptors.h"
#include "loop_verification/aligner_test_world.h"

namespace pangea {
namespace {

TEST(AlignerTest, RefusesAnotherRoom) {
  for (int run = 0; run < 20; ++run) {
    const TestAgent m = RunTestAgent(MakeTestRoom({.seed = 200u + run}), FirstAgent(run));
    const TestAgent c = RunTestAgent(MakeTestRoom({.seed = 300u + run}), SecondAgent(run));
    const Constraint constraint = Align(c, 9, m, 10, MakeTestCandidate(c, 9, m, 10, 0, 30));
    EXPECT_FALSE(constraint.accepted);
    EXPECT_THAT(constraint.reason, testing::AnyOf("PnP found too few inliers", "PnP found no pose",
                                                  "too few matched points with a depth",
                                                  "too few points found by projection"));
  }
}

// Two rooms with the same dozen objects at different places: the objects match perfectly,
// everything around them does not. The candidates are the pairs with most common corners, as from
// place recognition.
TEST(AlignerTest, RefusesIdenticalObjectsAtOtherPlaces) {
  int sharing = 0;
  std::map<std::string, int> reasons;
  for (int run = 0; run < 20; ++run) {
    TestRoomOptions first{.seed = 400u + run, .num_points = 1500, .num_objects = 12};
    TestRoomOptions second = first;
    second.seed = 500u + run;
    TestAgentOptions walk_m = FirstAgent(run), walk_c = SecondAgent(run);
    walk_m.num_keyframes = walk_c.num_keyframes = 20;
    walk_m.step_angle = walk_c.step_angle = 0.3;
    const TestAgent m = RunTestAgent(MakeTestRoom(first), walk_m);
    const TestAgent c = RunTestAgent(MakeTestRoom(second), walk_c);
    for (const auto& [query, match] : PairsThatShareMost(c, m, 3)) {
      const PlaceCandidate candidate = MakeTestCandidateByDescriptor(c, query, m, match);
      sharing += candidate.corner_matches.size() > 20 ? 1 : 0;
      const Constraint constraint = Align(c, query, m, match, candidate);
      ++reasons[constraint.reason];
      EXPECT_FALSE(constraint.accepted)
          << run << " " << query << " " << match << " inliers " << constraint.num_inliers;
    }
  }
  for (const auto& [reason, count] : reasons) {
    std::cout << reason << ": " << count << "\n";
  }
  EXPECT_GT(sharing, 40);  // or nothing was tested
}

// The worst case: one object fills much of the view, from the same side in both rooms, so that it
// aligns perfectly; only the scene around it reveals the error. The same walks in one room are
// accepted.
TEST(AlignerTest, RefusesOneObjectSeenFromTheSameSide) {
  for (int run = 0; run < 10; ++run) {
    std::mt19937_64 random(run);
    auto room = MakeTestRoom({.seed = 600u + run});
    auto other = MakeTestRoom({.seed = 700u + run});
    TestAgentOptions walk_m = FirstAgent(run), walk_c = SecondAgent(run);
    walk_c.radius = 2.1;
    walk_c.look_outward = 0.8;
    const Eigen::Vector3d ahead(2.0, 3.6, 1.6);
    std::uniform_real_distribution<double> side(-0.6, 0.6);
    for (int i = 0; i < 200; ++i) {
      const TestPoint point{ahead + Eigen::Vector3d(side(random), side(random), side(random)),
                            RandomDescriptor(random)};
      room.insert(room.begin(), point);
      other.insert(other.begin(), point);
    }
    const TestAgent m = RunTestAgent(room, walk_m);
    const TestAgent c_same = RunTestAgent(room, walk_c), c_other = RunTestAgent(other, walk_c);
    EXPECT_TRUE(Align(c_same, 9, m, 10, MakeTestCandidateByDescriptor(c_same, 9, m, 10)).accepted);
    const Constraint constraint =
        Align(c_other, 9, m, 10, MakeTestCandidateByDescriptor(c_other, 9, m, 10));
    EXPECT_FALSE(constraint.accepted);
    EXPECT_THAT(constraint.reason,
                testing::AnyOf("the surroundings contradict", "inliers too close together"));
  }
}

TEST(AlignerTest, RefusesWhatContradictsGravity) {
  const auto room = MakeTestRoom({.seed = 6});
  const TestAgent m = RunTestAgent(room, FirstAgent(0));
  const double calibration_error = 0.018;  // of two cameras, badly calibrated
  for (const double tilt : {0.0, calibration_error, 0.04, 0.08}) {
    TestAgentOptions tilted = SecondAgent(0);
    tilted.odom_tilt = tilt;
    const TestAgent c = RunTestAgent(room, tilted);
    const Constraint constraint = Align(c, 9, m, 10, MakeTestCandidate(c, 9, m, 10, 40, 0));
    EXPECT_EQ(constraint.reason,
              tilt > calibration_error ? "roll or pitch contradicts gravity" : "");
  }
}

TEST(AlignerTest, RefusesTooFewPoints) {
  const auto room = MakeTestRoom({.seed = 7, .num_points = 150});
  const TestAgent m = RunTestAgent(room, FirstAgent(0));
  const TestAgent c = RunTestAgent(room, SecondAgent(0));
  const Constraint constraint = Align(c, 9, m, 10, MakeTestCandidate(c, 9, m, 10, 40, 0));
  EXPECT_FALSE(constraint.accepted);
  EXPECT_FALSE(constraint.reason.empty());
}

// An accepted constraint should have an error below half a metre and five degrees. The view is a
// narrow part of a distant wall: with few points, a rotation and a sideways step cannot be
// distinguished well enough for this; with many they can.
TEST(AlignerTest, RefusesWhatIsTooUncertain) {
  for (const int num_points : {60, 250}) {
    std::mt19937_64 random(9);
    std::uniform_real_distribution<double> across(-4.8, 4.8), up(-2.9, 2.9), ahead(12, 12.6);
    std::vector<TestPoint> wall;
    for (int i = 0; i < num_points; ++i) {
      const Eigen::Vector3d p(ahead(random), across(random), 1.7 + up(random));
      wall.push_back({YawRotation(1.75) * p, RandomDescriptor(random)});
    }
    TestAgentOptions walk_m = FirstAgent(0), walk_c = SecondAgent(0);
    walk_m.radius = 0.6;
    walk_c.radius = 0.8;
    const TestAgent m = RunTestAgent(wall, walk_m), c = RunTestAgent(wall, walk_c);
    const Constraint constraint =
        Align(c, 9, m, 10, MakeTestCandidate(c, 9, m, 10, 40, 0), OnlyTracked());
    EXPECT_GT(constraint.num_inliers, 100);
    EXPECT_EQ(constraint.reason, num_points == 60 ? "too uncertain" : "");
  }
}

// The same wall with near points in front of it: one alone would determine the pose, right or
// wrong.
TEST(AlignerTest, RefusesWhatHangsOnOneLandmark) {
  std::mt19937_64 random(9);
  std::uniform_real_distribution<double> across(-4.8, 4.8), up(-2.9, 2.9), ahead(12, 12.6);
  const auto point_at = [&](double x, double y, double z) {
    return TestPoint{YawRotation(1.75) * Eigen::Vector3d(x, y, z), RandomDescriptor(random)};
  };
  std::vector<TestPoint> wall;
  for (int i = 0; i < 60; ++i) {
    wall.push_back(point_at(ahead(random), across(random), 1.7 + up(random)));
  }
  for (const auto& [num_near, reason] :
       std::map<int, std::string>{{0, "too uncertain"}, {1, "hangs on one landmark"}, {16, ""}}) {
    std::vector<TestPoint> points = wall;
    for (int i = 0; i < num_near; ++i) {
      points.insert(points.begin(), point_at(4 + 0.1 * i, -0.8 + 0.1 * i, 1.5 + 0.1 * (i % 5)));
    }
    TestAgentOptions walk_m = FirstAgent(0), walk_c = SecondAgent(0);
    walk_m.relative_depth_sigma = walk_c.relative_depth_sigma = 0.005;
    walk_m.radius = 0.6;
    walk_c.radius = 0.8;
    const TestAgent m = RunTestAgent(points, walk_m), c = RunTestAgent(points, walk_c);
    const Constraint constraint =
        Align(c, 9, m, 10, MakeTestCandidate(c, 9, m, 10, 40, 0), OnlyTracked());
    EXPECT_EQ(constraint.reason, reason) << num_near;
  }
}

// Several near points in front of the wall, the same in both walks or only vaguely similar: the
// latter may all be wrong.
TEST(AlignerTest, RefusesWhatHangsOnVagueMatches) {
  std::mt19937_64 random(9);
  std::uniform_real_distribution<double> across(-4.8, 4.8), up(-2.9, 2.9), ahead(12, 12.6);
  const auto point_at = [&](double x, double y, double z) {
    return TestPoint{YawRotation(1.75) * Eigen::Vector3d(x, y, z), RandomDescriptor(random)};
  };
  std::vector<TestPoint> points;
  constexpr int kNear = 8;
  for (int i = 0; i < kNear; ++i) {
    points.push_back(point_at(4 + 0.1 * i, -0.8 + 0.2 * i, 1.3 + 0.1 * i));
  }
  for (int i = 0; i < 60; ++i) {
    points.push_back(point_at(ahead(random), across(random), 1.7 + up(random)));
  }
  for (const bool vague : {false, true}) {
    std::vector<TestPoint> points_c = points;
    for (int i = 0; vague && i < kNear; ++i) {
      for (size_t bit = 0; bit < kDescriptorBits / 4; ++bit) {  // and noise: no sure match
        FlipBit(&points_c[i].descriptor, bit);
      }
    }
    TestAgentOptions walk_m = FirstAgent(0), walk_c = SecondAgent(0);
    walk_m.relative_depth_sigma = walk_c.relative_depth_sigma = 0.005;
    walk_m.radius = 0.6;
    walk_c.radius = 0.8;
    const TestAgent m = RunTestAgent(points, walk_m), c = RunTestAgent(points_c, walk_c);
    const Constraint constraint =
        Align(c, 9, m, 10, MakeTestCandidate(c, 9, m, 10, 40, 0), OnlyTracked());
    EXPECT_EQ(constraint.reason, vague ? "hangs on vague matches" : "");
    EXPECT_LT(std::sqrt(constraint.covariance(0, 0)), 0.1);
  }
}

// Corners are slightly wrong, upwards in one half of the image and downwards in the other: each is
// an inlier, and together they give a pose.
TEST(AlignerTest, RefusesHalvesThatDisagree) {
  const auto room = MakeTestRoom({.seed = 9});
  const TestAgent m = RunTestAgent(room, FirstAgent(0));
  const TestAgent c = RunTestAgent(room, SecondAgent(0));
  TestAgent off = c;
  for (Keyframe& keyframe : off.keyframes) {
    for (Corner& corner : keyframe.corners) {
      const bool left = corner.pixel.x() < 0.5F * static_cast<float>(keyframe.camera.width);
      corner.pixel.y() += left ? 3.5F : -3.5F;
    }
  }
  const PlaceCandidate candidate = MakeTestCandidate(c, 9, m, 10, 40, 0);
  EXPECT_EQ(Align(c, 9, m, 10, candidate).reason, "");
  EXPECT_EQ(Align(off, 9, m, 10, candidate).reason, "the halves of the view disagree");
}

}  // namespace
}  // namespace pangea
