#include "common/alignment/joint_ba.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "common/alignment/alignment_test_world.h"
#include "common/alignment/projection_search.h"

namespace pangea {
namespace {

// A match's landmark in both windows: the one of a pair that matches join has the other's name.
using Joined = std::map<std::pair<Direction, int>, std::set<std::pair<Direction, int>>>;

Joined Partners(const Window& m, const Window& c, const std::vector<PointMatch>& matches) {
  Joined partners;
  for (const PointMatch& match : matches) {
    const bool forward = match.direction == Direction::kForward;
    const int other =
        (forward ? c : m).landmark_of_corner[match.observed.frame][match.observed.corner];
    const std::pair own{match.direction, match.landmark};
    partners[own].insert(own);
    if (other < 0) {
      continue;
    }
    const std::pair mate{forward ? Direction::kReverse : Direction::kForward, other};
    partners[own].insert(mate);
    partners[mate].insert(own);
  }
  return partners;
}

// What the optimisation says of its covariance without the landmark that says most is what an
// optimisation without that landmark says.
TEST(JointBaTest, CovarianceWithoutOneLandmark) {
  const auto room = MakeTestRoom({.seed = 3, .num_points = 400});
  TestAgentOptions walk_m, walk_c;
  walk_m.num_keyframes = walk_c.num_keyframes = 6;
  walk_m.pixel_sigma = walk_c.pixel_sigma = 0.3;  // all are inliers
  walk_c.map = {2, 2000};
  walk_c.radius = 2.3;
  const TestAgent agent_m = RunTestAgent(room, walk_m), agent_c = RunTestAgent(room, walk_c);
  SubmapStore store;
  for (const TestAgent* agent : {&agent_m, &agent_c}) {
    for (const Keyframe& keyframe : agent->keyframes) {
      store.Add(keyframe);
    }
  }
  const Window m = MakeWindow(store.WindowUpTo({walk_m.map, 5}, 5), {});
  const Window c = MakeWindow(store.WindowUpTo({walk_c.map, 5}, 5), {});
  const Rigid3 T_m_c = m.T_w_body.back() * agent_m.T_room_body[5].Inverse() *
                       agent_c.T_room_body[5] * c.T_w_body.back().Inverse();
  std::vector<PointMatch> matches;
  for (const Direction direction : {Direction::kForward, Direction::kReverse}) {
    for (int frame = 0; frame < 5; ++frame) {
      const SearchResult found =
          SearchByProjection(m, c, direction, frame, {T_m_c, 1e-6 * Matrix6d::Identity()}, {});
      matches.insert(matches.end(), found.matches.begin(), found.matches.end());
    }
  }
  JointBaOptions options;
  options.max_chi2 = options.max_depth_chi2 = 1e3;
  const auto all = SolveJointBa(m, c, matches, T_m_c, options);
  ASSERT_TRUE(all);

  double worst = 0;
  const Joined partners = Partners(m, c, matches);
  for (const auto& [landmark, joined] : partners) {
    std::vector<PointMatch> others;
    for (const PointMatch& match : matches) {
      if (!joined.contains({match.direction, match.landmark})) {
        others.push_back(match);
      }
    }
    const auto without = SolveJointBa(m, c, others, T_m_c, options);
    ASSERT_TRUE(without);
    worst = std::max(worst, without->covariance.topLeftCorner<3, 3>().trace());
  }
  const double said = all->covariance_without_one.topLeftCorner<3, 3>().trace();
  const double with_all = all->covariance.topLeftCorner<3, 3>().trace();
  EXPECT_GT(said / with_all, 1.03);
  EXPECT_NEAR(said / worst, 1, 0.03);
}

}  // namespace
}  // namespace pangea
