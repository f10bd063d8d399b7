#include "vio/point_geometry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <functional>

#include "vio/window_test_state.h"

namespace pangea::vio {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

// Central differences along the true error coordinates of the window.
MatrixXd NumericJacobian(const WindowState& state,
                         const std::function<VectorXd(const WindowState&)>& f) {
  constexpr double kStep = 1e-5;
  MatrixXd J(f(state).size(), state.size());
  for (int k = 0; k < state.size(); ++k) {
    WindowState plus = state, minus = state;
    plus.Retract(kStep * VectorXd::Unit(state.size(), k));
    minus.Retract(-kStep * VectorXd::Unit(state.size(), k));
    J.col(k) = (f(plus) - f(minus)) / (2 * kStep);
  }
  return J;
}

// The point's rays in all clones, with noise of `sigma` times `noise`.
std::vector<ClonedRay> RaysOf(const WindowState& state, const AnchoredPoint& point, double sigma,
                              double noise, std::mt19937_64& rng) {
  std::vector<ClonedRay> rays;
  for (int i = 0; i < static_cast<int>(state.clones.size()); ++i) {
    const auto predicted = PredictRay(state, point, i, false);
    rays.push_back({i, predicted->ray + noise * RandomVector(rng, sigma).head<2>(), sigma});
  }
  return rays;
}

TEST(PredictRay, DerivativesMatchDifferencesInEveryColumn) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    const WindowState state = TestWindow(4, 3, seed);
    for (int landmark = 0; landmark < 3; ++landmark) {
      for (int clone = 0; clone < 4; ++clone) {
        const AnchoredPoint& point = state.landmarks[landmark].second;
        const auto predicted = PredictRay(state, point, clone, true);
        ASSERT_TRUE(predicted);
        const MatrixXd numeric = NumericJacobian(state, [&](const WindowState& s) -> VectorXd {
          return PredictRay(s, s.landmarks[landmark].second, clone, false)->ray;
        });
        MatrixXd H = predicted->H_x;
        EXPECT_EQ(H.middleCols(state.LandmarkOffset(landmark), 3).norm(), 0);
        H.middleCols(state.LandmarkOffset(landmark), 3) = predicted->H_f;
        EXPECT_LT((H - numeric).cwiseAbs().maxCoeff(), 1e-7)
            << "seed " << seed << " landmark " << landmark << " clone " << clone;
      }
    }
  }
}

TEST(PredictRay, InItsOwnAnchorAPointIsItsRay) {
  const WindowState state = TestWindow(3, 1, 1);
  const auto predicted = PredictRay(state, state.landmarks[0].second, 0, true);
  ASSERT_TRUE(predicted);
  EXPECT_LT((predicted->ray - state.landmarks[0].second.ray_rho.head<2>()).norm(), 1e-12);
  EXPECT_LT(predicted->H_x.cwiseAbs().maxCoeff(), 1e-12);
}

TEST(PredictRay, NothingBehindTheCamera) {
  WindowState state = TestWindow(2, 1, 1);
  state.clones[1].T_odom_body.q = state.clones[1].T_odom_body.q * YawRotation(M_PI);
  EXPECT_FALSE(PredictRay(state, state.landmarks[0].second, 1, true));
}

TEST(Reanchor, SamePointAndDerivativesMatchDifferences) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    const WindowState state = TestWindow(4, 2, seed);
    for (int landmark = 0; landmark < 2; ++landmark) {
      for (int anchor = 0; anchor < 4; ++anchor) {
        const auto moved = Reanchor(state, landmark, anchor);
        ASSERT_TRUE(moved);
        for (int clone = 0; clone < 4; ++clone) {
          const auto before = PredictRay(state, state.landmarks[landmark].second, clone, false);
          const auto after = PredictRay(state, moved->point, clone, false);
          EXPECT_LT((before->ray - after->ray).norm(), 1e-12);
        }
        const MatrixXd numeric = NumericJacobian(state, [&](const WindowState& s) -> VectorXd {
          return Reanchor(s, landmark, anchor)->point.ray_rho;
        });
        EXPECT_LT((moved->J - numeric).cwiseAbs().maxCoeff(), 1e-7) << "seed " << seed;
      }
    }
  }
}

TEST(Triangulate, IsExactWithoutNoise) {
  std::mt19937_64 rng(3);
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    const WindowState state = TestWindow(5, 1, seed);
    const auto rays = RaysOf(state, state.landmarks[0].second, 2e-3, 0, rng);
    const auto found = Triangulate(state, rays, 0);
    ASSERT_TRUE(found) << "seed " << seed;
    EXPECT_EQ(found->point.anchor_utime, state.clones[0].utime);
    EXPECT_LT((found->point.ray_rho - state.landmarks[0].second.ray_rho).norm(), 1e-6);
    EXPECT_LT(found->rms, 1e-3);
  }
}

TEST(Triangulate, CovarianceIsHonest) {
  std::mt19937_64 rng(4);
  const WindowState state = TestWindow(6, 1, 2);
  const Vector3d truth = state.landmarks[0].second.ray_rho;
  double nees = 0;
  constexpr int kTrials = 400;
  for (int trial = 0; trial < kTrials; ++trial) {
    const auto found =
        Triangulate(state, RaysOf(state, state.landmarks[0].second, 2e-3, 1, rng), 0);
    ASSERT_TRUE(found);
    const Vector3d e = found->point.ray_rho - truth;
    nees += e.dot(found->covariance.llt().solve(e)) / kTrials;
  }
  // Mean of 400 chi-square(3): 3 +- 0.12.
  EXPECT_NEAR(nees, 3, 0.5);
}

TEST(Triangulate, RefusesADepthThatIsNotDetermined) {
  WindowState state = TestWindow(5, 1, 1);
  std::mt19937_64 rng(5);
  for (Clone& clone : state.clones) {
    clone.T_odom_body.t = state.clones[0].T_odom_body.t;
    clone.T_odom_body.q = state.clones[0].T_odom_body.q;
  }
  EXPECT_FALSE(Triangulate(state, RaysOf(state, state.landmarks[0].second, 2e-3, 1, rng), 0));
}

TEST(WithoutPoint, RowsAreOrthogonalToThePointAndKeepWhatTheRestSays) {
  std::mt19937_64 rng(6);
  const WindowState state = TestWindow(5, 1, 7);
  const auto rays = RaysOf(state, state.landmarks[0].second, 2e-3, 1, rng);
  const auto full = MeasurePoint(state, state.landmarks[0].second, rays);
  ASSERT_TRUE(full);
  // The point's own columns run through the projection beside the state's: they must vanish.
  PointMeasurement probe = *full;
  probe.x.H.conservativeResize(Eigen::NoChange, state.size() + 3);
  probe.x.H.rightCols(3) = full->H_f;
  const Measurement left = WithoutPoint(probe);
  ASSERT_EQ(left.r.size(), full->x.r.size() - 3);
  EXPECT_LT(left.H.rightCols(3).norm(), 1e-9 * full->H_f.norm());
  // The Schur complement of the point in the normal equations is what is left.
  const MatrixXd& H = full->x.H;
  const MatrixXd A_ff_inv = (full->H_f.transpose() * full->H_f).inverse();
  const MatrixXd A_xf = H.transpose() * full->H_f;
  const MatrixXd A = H.transpose() * H - A_xf * A_ff_inv * A_xf.transpose();
  const VectorXd b =
      H.transpose() * full->x.r - A_xf * A_ff_inv * full->H_f.transpose() * full->x.r;
  const MatrixXd H_left = left.H.leftCols(state.size());
  EXPECT_LT((H_left.transpose() * H_left - A).norm(), 1e-8 * A.norm());
  EXPECT_LT((H_left.transpose() * left.r - b).norm(), 1e-8 * b.norm());
}

}  // namespace
}  // namespace pangea::vio
