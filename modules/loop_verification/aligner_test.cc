#include "loop_verification/aligner.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <iostream>
#include <map>
#include <numbers>
#include <random>

#include "core/testing/test_descriptors.h"
#include "loop_verification/drift_gate.h"
#include "loop_verification/loop_verification_test_world.h"

namespace pangea {
namespace {

const LoopVerificationGate kNoGate = [](const Rigid3&) { return std::string(); };

Constraint Align(const TestAgent& query_agent, int query, const TestAgent& match_agent, int match,
                 const PlaceCandidate& candidate, const LoopVerificationOptions& options = {},
                 LoopVerificationReport* report = nullptr) {
  SubmapStore store;
  for (const TestAgent* agent : {&query_agent, &match_agent}) {
    for (const Keyframe& keyframe : agent->keyframes) {
      store.Add(keyframe);
    }
  }
  return Aligner(options).Align(
      {store.WindowUpTo(match_agent.keyframes[match].id, options.visibility_keyframes),
       store.WindowUpTo(query_agent.keyframes[query].id, options.visibility_keyframes),
       {}},
      candidate, kNoGate, report);
}

// Whose windows hold what the odometry gave a depth, and nothing else.
LoopVerificationOptions OnlyTracked() {
  LoopVerificationOptions options;
  options.window.triangulation.few_landmarks = -1;
  return options;
}

TestAgentOptions SecondAgent(int run) {
  TestAgentOptions options;
  options.map = {2, 2000 + run};
  options.radius = 2.3;
  options.start_angle = 0.15;
  options.height = 1.9;
  options.look_outward = 0.7;
  options.num_keyframes = 12;
  return options;
}

TestAgentOptions FirstAgent(int run) {
  TestAgentOptions options;
  options.map = {1, 1000 + run};
  options.num_keyframes = 12;
  return options;
}

// The estimate's covariance must be what its errors are: over many worlds the normalised error
// squared of 6 degrees of freedom has mean 6. All that the covariance counts is drawn as it claims:
// pixels, depths, edges, and a scale of each odometry that all its depths and edges share.
TEST(AlignerTest, ErrorsAreWhatTheCovarianceSays) {
  double nees = 0, error_m = 0;
  int accepted = 0;
  constexpr int kRuns = 40;
  LoopVerificationOptions options;
  options.ba.systematic_px = 0;  // this world has no such errors
  std::mt19937_64 random(1);
  std::normal_distribution<double> log_scale(0, options.ba.scale_sigma);
  for (int run = 0; run < kRuns; ++run) {
    const auto room = MakeTestRoom({.seed = 100u + run});
    TestAgentOptions walk_m = FirstAgent(run), walk_c = SecondAgent(run);
    walk_m.log_scale = log_scale(random);
    walk_c.log_scale = log_scale(random);
    const TestAgent m = RunTestAgent(room, walk_m);
    const TestAgent c = RunTestAgent(room, walk_c);
    const Constraint constraint =
        Align(c, 9, m, 10, MakeTestCandidate(c, 9, m, 10, 40, 15), options);
    if (!constraint.accepted) {
      continue;
    }
    ++accepted;
    const Rigid3 truth = m.T_room_body[10].Inverse() * c.T_room_body[9];
    const Vector6d error = constraint.T_from_to.Minus(truth);
    nees += error.dot(constraint.covariance.ldlt().solve(error));
    error_m += error.head<3>().norm();
  }
  EXPECT_GE(accepted, kRuns * 9 / 10);
  EXPECT_NEAR(nees / accepted, 6, 1.6);  // three standard deviations of the mean
  EXPECT_LT(error_m / accepted, 0.02);
}

TEST(AlignerTest, SameInputSameResult) {
  const auto room = MakeTestRoom({.seed = 3});
  const TestAgent m = RunTestAgent(room, FirstAgent(0));
  const TestAgent c = RunTestAgent(room, SecondAgent(0));
  const PlaceCandidate candidate = MakeTestCandidate(c, 9, m, 10, 40, 15);
  const Constraint first = Align(c, 9, m, 10, candidate);
  const Constraint second = Align(c, 9, m, 10, candidate);
  EXPECT_EQ(first.T_from_to.t, second.T_from_to.t);
  EXPECT_EQ(first.covariance, second.covariance);
}

// A handful of corners with a depth is enough: the rest is found by projection.
TEST(AlignerTest, FewCandidateMatchesSuffice) {
  const auto room = MakeTestRoom({.seed = 4});
  const TestAgent m = RunTestAgent(room, FirstAgent(0));
  const TestAgent c = RunTestAgent(room, SecondAgent(0));
  const Constraint constraint = Align(c, 9, m, 10, MakeTestCandidate(c, 9, m, 10, 12, 12));
  EXPECT_TRUE(constraint.accepted) << constraint.reason;
}

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

// Two rooms with the same dozen objects, at other places: the objects match perfectly, everything
// around them does not. The candidates are the pairs that share most, as a place recognition would
// send them.
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

// The worst case: one object large in view, from the same side in both rooms, so that it aligns
// perfectly; only what is around it tells. The same walks in one room are accepted.
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

// The images' tilt is weighed by how well they know it about that axis: about the line of sight
// they know a rotation less well than about the others.
TEST(AlignerTest, TheTiltIsWeighedAboutItsAxis) {
  const auto room = MakeTestRoom({.seed = 6});
  const TestAgent m = RunTestAgent(room, FirstAgent(0));
  LoopVerificationOptions options;
  options.gravity_floor = 0;
  options.max_tilt_chi2 = 1e9;
  TestAgentOptions tilted = SecondAgent(0);
  tilted.odom_tilt = 0.018;
  const TestAgent c = RunTestAgent(room, tilted);
  SubmapStore store;
  for (const TestAgent* agent : {&m, &c}) {
    for (Keyframe keyframe : agent->keyframes) {
      keyframe.roll_pitch_covariance.setZero();
      store.Add(keyframe);
    }
  }
  const auto frames_m = store.WindowUpTo(m.keyframes[10].id, options.visibility_keyframes);
  const auto frames_c = store.WindowUpTo(c.keyframes[9].id, options.visibility_keyframes);
  LoopVerificationReport report;
  const Constraint constraint = Aligner(options).Align(
      {frames_m, frames_c, {}}, MakeTestCandidate(c, 9, m, 10, 40, 0), kNoGate, &report);
  ASSERT_TRUE(constraint.accepted) << constraint.reason;

  const Eigen::Quaterniond q_m = m.keyframes[10].T_odom_body.q, q_c = c.keyframes[9].T_odom_body.q;
  const Eigen::Quaterniond q_m_c = q_m * constraint.T_from_to.q * q_c.conjugate();
  const Eigen::Vector3d up = q_m_c * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d rotation =
      LogSo3(Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), up));
  const Eigen::Matrix3d of_rotation =
      q_m * constraint.covariance.bottomRightCorner<3, 3>() * q_m.conjugate();
  const Eigen::Matrix2d information = of_rotation.topLeftCorner<2, 2>().inverse();
  const double chi2 = rotation.head<2>().dot(information * rotation.head<2>());
  EXPECT_NEAR(report.tilt, rotation.norm(), 1e-4);
  EXPECT_NEAR(report.tilt_chi2 / chi2, 1, 0.01);
  const Eigen::Vector2d across(-rotation.y(), rotation.x());
  EXPECT_GT(std::abs(across.dot(information * across) / chi2 - 1), 0.1) << "then axes would matter";
}

TEST(AlignerTest, RefusesTooFewPoints) {
  const auto room = MakeTestRoom({.seed = 7, .num_points = 150});
  const TestAgent m = RunTestAgent(room, FirstAgent(0));
  const TestAgent c = RunTestAgent(room, SecondAgent(0));
  const Constraint constraint = Align(c, 9, m, 10, MakeTestCandidate(c, 9, m, 10, 40, 0));
  EXPECT_FALSE(constraint.accepted);
  EXPECT_FALSE(constraint.reason.empty());
}

// Accepted is a promise of half a metre and five degrees. A narrow piece of a far wall in view:
// with few points a rotation and a step to the side cannot be told apart well enough to keep it,
// with many they can.
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

// The same wall with near points before it: one alone would decide the pose, right or wrong.
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

// Several near points before the wall, the same in both walks or only vaguely alike: these may be
// wrong together.
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

// Corners a little off, one half of the image up and the other down: each is an inlier, and
// together they give a pose.
TEST(AlignerTest, RefusesHalvesThatDisagree) {
  const auto room = MakeTestRoom({.seed = 9});
  const TestAgent m = RunTestAgent(room, FirstAgent(0));
  const TestAgent c = RunTestAgent(room, SecondAgent(0));
  TestAgent off = c;
  for (Keyframe& keyframe : off.keyframes) {
    for (Corner& corner : keyframe.corners) {
      const bool left = corner.pixel.x() < 0.5F * static_cast<float>(keyframe.camera.width);
      corner.pixel.y() += left ? 3.0F : -3.0F;
    }
  }
  const PlaceCandidate candidate = MakeTestCandidate(c, 9, m, 10, 40, 0);
  EXPECT_EQ(Align(c, 9, m, 10, candidate).reason, "");
  EXPECT_EQ(Align(off, 9, m, 10, candidate).reason, "the halves of the view disagree");
}

// Each bar, set out of reach, refuses in its own step what is accepted otherwise.
TEST(AlignerTest, EachBarIsObeyed) {
  const auto room = MakeTestRoom({.seed = 4});
  const TestAgent m = RunTestAgent(room, FirstAgent(0));
  const TestAgent c = RunTestAgent(room, SecondAgent(0));
  const PlaceCandidate candidate = MakeTestCandidate(c, 9, m, 10, 40, 15);
  LoopVerificationReport accepted;
  ASSERT_TRUE(Align(c, 9, m, 10, candidate, {}, &accepted).accepted);
  const auto refused = [&](auto bar, auto value) {
    LoopVerificationOptions options;
    options.*bar = value;
    LoopVerificationReport report;
    const Constraint constraint = Align(c, 9, m, 10, candidate, options, &report);
    return report.refused_by + ": " + constraint.reason;
  };
  using Options = LoopVerificationOptions;
  EXPECT_EQ(refused(&Options::min_pnp_inliers, 10000), "PnP: too few matched points with a depth");
  EXPECT_EQ(refused(&Options::min_pnp_inliers, accepted.pnp_inliers + 1),
            "PnP: PnP found too few inliers");
  EXPECT_EQ(refused(&Options::max_view_angle, 0.05), "views: views do not overlap");
  EXPECT_EQ(refused(&Options::max_distance_m, 0.1), "views: views do not overlap");
  const std::string in_two = "visibility in the two keyframes: ";
  EXPECT_EQ(refused(&Options::min_found, 1000), in_two + "too few points found by projection");
  EXPECT_EQ(refused(&Options::min_comparable, 10000),
            in_two + "too few points ought to be seen from both");
  EXPECT_EQ(refused(&Options::min_found_share, 1.1), in_two + "the surroundings contradict");
  EXPECT_EQ(refused(&Options::min_first_supported_share, 1.1),
            in_two + "the surroundings contradict");
  EXPECT_EQ(refused(&Options::min_inliers, 10000),
            "joint bundle adjustment: too few points found by projection");
  EXPECT_EQ(refused(&Options::max_tilt, 1e-9), "gravity: roll or pitch contradicts gravity");
  EXPECT_EQ(refused(&Options::max_tilt_chi2, 1e-9), "gravity: roll or pitch contradicts gravity");
  EXPECT_EQ(refused(&Options::min_inlier_ratio, 1.1), "inliers: too many outliers");
  EXPECT_EQ(refused(&Options::min_occupied_cells, 25), "inliers: inliers too close together");
  EXPECT_EQ(refused(&Options::max_sigma_m, 1e-6), "certainty: too uncertain");
  EXPECT_EQ(refused(&Options::max_sigma_rad, 1e-6), "certainty: too uncertain");
  EXPECT_EQ(refused(&Options::min_supported_share, 1.1),
            "visibility along the way: the surroundings contradict");
  EXPECT_EQ(refused(&Options::max_halves_chi2, 1e-9),
            "halves of the view: the halves of the view disagree");
}

TEST(AlignerTest, TheGateOfTheKindIsObeyed) {
  const auto room = MakeTestRoom({.seed = 8});
  TestAgentOptions walk = FirstAgent(0);
  walk.num_keyframes = 80;
  walk.step_angle = 2 * std::numbers::pi / 68;
  const TestAgent agent = RunTestAgent(room, walk);
  SubmapStore store;
  for (const Keyframe& keyframe : agent.keyframes) {
    store.Add(keyframe);
  }
  const PlaceCandidate candidate = MakeTestCandidate(agent, 76, agent, 9, 40, 10);
  const auto align = [&](const DriftGateOptions& options) {
    return Aligner({}).Align(
        {store.WindowUpTo({walk.map, 9}, 5), store.WindowUpTo({walk.map, 76}, 5), {}}, candidate,
        MakeDriftGate(options, *store.PathBetween({walk.map, 9}, {walk.map, 76}),
                      agent.keyframes[76].T_odom_body.t));
  };
  EXPECT_TRUE(align({}).accepted) << align({}).reason;
  DriftGateOptions none;
  none.max_drift_m = none.max_drift_share = 0;
  EXPECT_EQ(align(none).reason, "more drift than odometry makes");
  DriftGateOptions no_yaw;
  no_yaw.max_yaw = no_yaw.max_yaw_per_m = 0;
  EXPECT_EQ(align(no_yaw).reason, "more drift than odometry makes");
}

// As on real phones, where a keyframe has depths for few of its corners.
TEST(Aligner, FewDepthsAreEnoughWhereCornersAreMatchedBetweenNeighbours) {
  TestAgent m = RunTestAgent(MakeTestRoom({}), {});
  TestAgent c = RunTestAgent(MakeTestRoom({}), SecondAgent(0));
  for (TestAgent* agent : {&m, &c}) {
    for (Keyframe& keyframe : agent->keyframes) {
      keyframe.points.resize(std::min<size_t>(keyframe.points.size(), 4));
    }
  }
  const PlaceCandidate candidate = MakeTestCandidate(c, 9, m, 10, 40, 15);
  EXPECT_EQ(Align(c, 9, m, 10, candidate).reason, "");
  EXPECT_FALSE(Align(c, 9, m, 10, candidate, OnlyTracked()).accepted);
}

}  // namespace
}  // namespace pangea
