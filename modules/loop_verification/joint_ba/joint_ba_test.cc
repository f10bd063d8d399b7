#include "loop_verification/joint_ba/joint_ba.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "loop_verification/joint_ba/joint_ba_test_world.h"

namespace pangea {
namespace {

// By landmark (direction, index): the landmarks of both windows that matches join with it.
using Joined = std::map<std::pair<Direction, int>, std::set<std::pair<Direction, int>>>;

Joined Partners(const WindowPair& windows, const std::vector<PointMatch>& matches) {
  Joined partners;
  for (const PointMatch& match : matches) {
    const int other = windows.Observer(match.direction)
                          .landmark_of_corner[match.observed.frame][match.observed.corner];
    const std::pair own{match.direction, match.landmark};
    partners[own].insert(own);
    if (other < 0) {
      continue;
    }
    const bool forward = match.direction == Direction::kForward;
    const std::pair mate{forward ? Direction::kReverse : Direction::kForward, other};
    partners[own].insert(mate);
    partners[mate].insert(own);
  }
  return partners;
}

int LandmarkAt(const Window& window, const CornerRef& corner) {
  return window.landmark_of_corner[corner.frame][corner.corner];
}

class JointBaTest : public JointBaTestWindows {
 protected:
  // Trace of the position's covariance, from the matches whose landmarks satisfy `keep`.
  template <typename Keep>
  double PositionTrace(const Keep& keep) const {
    std::vector<PointMatch> kept;
    for (const PointMatch& match : matches_) {
      if (keep(std::pair{match.direction, match.landmark})) {
        kept.push_back(match);
      }
    }
    const auto result = SolveJointBa(windows_, kept, T_m_c_, options_);
    return result ? result->covariance.topLeftCorner<3, 3>().trace() : 0;
  }
};

// Without the covariances with fewer landmarks, all else is the same.
TEST_F(JointBaTest, CovarianceOfAllLandmarksAlone) {
  const auto whole = SolveJointBa(windows_, matches_, T_m_c_, options_);
  const auto result =
      SolveJointBa(windows_, matches_, T_m_c_, options_, JointBaCovariances::kOfAllLandmarks);
  ASSERT_TRUE(whole && result);
  EXPECT_EQ(result->T_Km_Kc.t, whole->T_Km_Kc.t);
  EXPECT_EQ(result->covariance, whole->covariance);
  EXPECT_TRUE(whole->covariance_of_sure && !result->covariance_of_sure);
}

// covariance_without_one equals the covariance of an optimisation without that landmark.
TEST_F(JointBaTest, CovarianceWithoutOneLandmark) {
  const auto all = SolveJointBa(windows_, matches_, T_m_c_, options_);
  ASSERT_TRUE(all);
  double worst = 0;
  for (const auto& [landmark, joined] : Partners(windows_, matches_)) {
    const double without =
        PositionTrace([&joined = joined](const auto& own) { return !joined.contains(own); });
    ASSERT_GT(without, 0);
    worst = std::max(worst, without);
  }
  const double said = all->covariance_without_one.topLeftCorner<3, 3>().trace();
  const double with_all = all->covariance.topLeftCorner<3, 3>().trace();
  EXPECT_GT(said / with_all, 1.03);
  EXPECT_NEAR(said / worst, 1, 0.03);
}

// covariance_of_sure equals the covariance of an optimisation with the sure landmarks alone.
TEST_F(JointBaTest, CovarianceOfSureLandmarks) {
  std::vector<int> distances;
  for (const PointMatch& match : matches_) {
    distances.push_back(match.distance);
  }
  std::sort(distances.begin(), distances.end());
  options_.sure_hamming = distances[distances.size() / 8];
  const auto all = SolveJointBa(windows_, matches_, T_m_c_, options_);
  ASSERT_TRUE(all && all->covariance_of_sure);
  std::set<std::pair<Direction, int>> sure;
  const Joined partners = Partners(windows_, matches_);
  for (const PointMatch& match : matches_) {
    if (match.distance <= options_.sure_hamming) {
      sure.merge(std::set(partners.at({match.direction, match.landmark})));
    }
  }
  const double of_sure = PositionTrace([&](const auto& own) { return sure.contains(own); });
  const double said = all->covariance_of_sure->topLeftCorner<3, 3>().trace();
  const double with_all = all->covariance.topLeftCorner<3, 3>().trace();
  EXPECT_GT(said / with_all, 1.1);
  EXPECT_NEAR(said / of_sure, 1, 0.05);

  options_.sure_hamming = -1;
  const auto none = SolveJointBa(windows_, matches_, T_m_c_, options_);
  ASSERT_TRUE(none);
  EXPECT_FALSE(none->covariance_of_sure);
}

// If neither map knows its scale, their distance is uncertain; if one does, the distance is known.
TEST_F(JointBaTest, MapsThatAreNotMetricDoubtTheDistance) {
  constexpr double kSigma = 0.3;
  const auto relative_sigma = [&](bool m_is_metric) {
    KeyframeStore store;
    Window m, c;
    for (const auto& [window, map, is_metric] :
         {std::tuple(&m, MapId{1, 1000}, m_is_metric), std::tuple(&c, MapId{2, 2000}, false)}) {
      for (const auto& said : store_.WindowUpTo({map, 5}, 5)) {
        Keyframe keyframe = said->keyframe();
        keyframe.scale_sigma = is_metric ? 0 : kSigma;
        store.Add(keyframe);
      }
      *window = MakeWindow(store.WindowUpTo({map, 5}, 5), {});
    }
    const auto result = SolveJointBa({m, c}, matches_, T_m_c_, options_);
    EXPECT_TRUE(result);
    const Eigen::Vector3d& t = result->T_Km_Kc.t;
    return std::sqrt(t.dot(result->covariance.topLeftCorner<3, 3>() * t)) / t.squaredNorm();
  };
  EXPECT_GT(relative_sigma(false), 0.5 * kSigma);
  EXPECT_LT(relative_sigma(true), 0.2 * kSigma);
}

// The systematic error does not average out: a rotation, and the translation with the same effect
// at the points' distance, equal in all directions.
TEST_F(JointBaTest, SystematicErrorsAreAdded) {
  options_.systematic_px = 0;
  const auto without = SolveJointBa(windows_, matches_, T_m_c_, options_);
  options_.systematic_px = 0.5;
  const auto with = SolveJointBa(windows_, matches_, T_m_c_, options_);
  ASSERT_TRUE(without && with);
  const Matrix6d added = with->covariance - without->covariance;
  const double rotation = 0.5 * windows_.c.keyframe(windows_.c.newest()).camera.PixelAngle();
  EXPECT_LT(
      (added.bottomRightCorner<3, 3>() - rotation * rotation * Eigen::Matrix3d::Identity()).norm(),
      1e-6 * rotation * rotation);
  const double step = std::sqrt(added(0, 0));
  EXPECT_GT(step / rotation, 2);  // the room is 4 to 6 m wide
  EXPECT_LT(step / rotation, 6);
  EXPECT_LT((added.topLeftCorner<3, 3>() - step * step * Eigen::Matrix3d::Identity()).norm(),
            1e-6 * step * step);
}

// With noise as stated, the rms is between one sigma per observation (if the point follows its
// corners) and the full noise of both dimensions.
TEST_F(JointBaTest, ResidualsHaveTheSizeOfTheNoise) {
  options_.pixel_sigma = 0.3;
  const auto result = SolveJointBa(windows_, matches_, T_m_c_, options_);
  ASSERT_TRUE(result);
  EXPECT_GT(result->rms_px, 0.3);
  EXPECT_LT(result->rms_px, std::sqrt(2.0) * 0.3);
}

// Mutual matches have half weight each, but their residuals are full. A point is held by its own
// corner with weight 1 and pulled by the other's with weight w: 1/(1 + w) of their distance
// remains, which is 2/3 instead of 1/2.
TEST_F(JointBaTest, CountingHalfDoesNotMakeAResidualSmaller) {
  std::vector<PointMatch> both_ways, one_way;
  for (const PointMatch& forward : matches_) {
    for (const PointMatch& reverse : matches_) {
      if (forward.direction == Direction::kForward && reverse.direction == Direction::kReverse &&
          LandmarkAt(windows_.c, forward.observed) == reverse.landmark &&
          LandmarkAt(windows_.m, reverse.observed) == forward.landmark) {
        both_ways.insert(both_ways.end(), {forward, reverse});
        one_way.push_back(forward);
      }
    }
  }
  ASSERT_GT(one_way.size(), 20u);
  const auto both = SolveJointBa(windows_, both_ways, T_m_c_, options_);
  const auto one = SolveJointBa(windows_, one_way, T_m_c_, options_);
  ASSERT_TRUE(both && one);
  EXPECT_NEAR(both->rms_px / one->rms_px, 4.0 / 3.0, 0.15);
}

// A pixel sigma that is six times too small is revealed by the residuals.
TEST_F(JointBaTest, TheCovarianceIsNeverSmallerThanTheResidualsSay) {
  options_.systematic_px = 0;
  options_.pixel_sigma = 0.3;
  const auto honest = SolveJointBa(windows_, matches_, T_m_c_, options_);
  options_.pixel_sigma = 0.05;
  const auto bold = SolveJointBa(windows_, matches_, T_m_c_, options_);
  ASSERT_TRUE(honest && bold);
  EXPECT_GT(bold->covariance.trace(), 0.5 * honest->covariance.trace());
}

}  // namespace
}  // namespace pangea
