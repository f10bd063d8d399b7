#include "vio/window/landmarks/point_geometry.h"
#include "vio/window/landmarks/landmark_factor.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "core/testing/numeric_jacobian.h"
#include "core/testing/test_random.h"
#include "vio/window/testing/window_test_world.h"

namespace pangea::vio {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

WindowTestOptions Rolling(uint64_t seed) {
  WindowTestOptions options;
  options.seed = seed;
  options.row_s = 0.02;
  options.late_s = 0.003;
  options.stamp_sigma_s = 0.004;
  return options;
}

TEST(PredictRay, DerivativesMatchDifferencesInEveryColumn) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    const WindowProblem problem = TestWindow(Rolling(seed));
    const WindowState& state = problem.state;
    for (const Landmark& landmark : problem.landmarks) {
      for (const FrameRay& seen : landmark.rays) {
        const int anchor = landmark.point.anchor;
        RowViews rows(state);
        const auto predicted = PredictRay(rows, PointInOdom(rows, landmark.point), seen);
        ASSERT_TRUE(predicted);
        MatrixXd J = MatrixXd::Zero(2, state.size());
        J.leftCols(kCalibrationSize) = predicted->J_calibration;
        J.middleCols<kPoseSize>(state.FirstRow(anchor)) += predicted->J_anchor;
        J.middleCols<kPoseSize>(state.FirstRow(seen.frame)) += predicted->J_frame;
        const auto add_stamp = [&](int frame, const Eigen::Vector2d& J_stamp) {
          if (state.frames[frame].has_stamp_error()) {
            J.col(state.FirstRow(frame) + kStampError) += J_stamp;
          }
        };
        add_stamp(anchor, predicted->J_anchor_stamp);
        add_stamp(seen.frame, predicted->J_frame_stamp);
        // The analytic Jacobian neglects only this: an error of the velocity moves the pose at the
        // row's time.
        J.middleCols<3>(state.FirstRow(anchor) + kVelocity) +=
            state.Ahead(anchor, landmark.point.anchor_row_s) * predicted->J_anchor.rightCols<3>();
        J.middleCols<3>(state.FirstRow(seen.frame) + kVelocity) +=
            state.Ahead(seen.frame, seen.row_s) * predicted->J_frame.rightCols<3>();
        const MatrixXd numeric = NumericJacobian(state, [&](const WindowState& s) -> VectorXd {
          RowViews changed(s);
          return PredictRayOnly(changed, InOdom(changed, landmark.point), seen).value();
        });
        EXPECT_LT((J - numeric).cwiseAbs().maxCoeff(), 1e-7) << "seed " << seed;
      }
    }
  }
}

TEST(PredictRay, DerivativesByThePointMatchDifferences) {
  const WindowProblem problem = TestWindow(Rolling(6));
  RowViews rows(problem.state);
  for (const Landmark& landmark : problem.landmarks) {
    for (const FrameRay& seen : landmark.rays) {
      const auto predicted = PredictRay(rows, PointInOdom(rows, landmark.point), seen);
      ASSERT_TRUE(predicted);
      const MatrixXd numeric = pangea::NumericJacobian(3, 1e-6, [&](const Vector3d& change) {
        AnchoredPoint moved = landmark.point;
        moved.ray_rho += change;
        return PredictRayOnly(rows, InOdom(rows, moved), seen).value();
      });
      EXPECT_LT((predicted->J_point - numeric).cwiseAbs().maxCoeff(), 1e-7);
    }
  }
}

TEST(PredictRay, InItsOwnAnchorAPointIsItsRay) {
  const WindowProblem problem = TestWindow(Rolling(1));
  const Landmark& landmark = problem.landmarks[0];
  RowViews rows(problem.state);
  const auto predicted = PredictRay(rows, PointInOdom(rows, landmark.point), landmark.rays[0]);
  ASSERT_TRUE(predicted);
  const FrameRay& own = landmark.rays[0];
  EXPECT_LT((own.ray - predicted->ray).norm(), 1e-12);
  EXPECT_LT((own.RayBy(problem.state) - landmark.point.ray_rho.head<2>()).norm(), 1e-12);
  EXPECT_LT((predicted->J_anchor + predicted->J_frame).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LT(predicted->J_calibration.leftCols<kIntrinsics>().cwiseAbs().maxCoeff(), 1e-12);
}

TEST(RowViews, AreOfTheRowThatIsAskedFor) {
  const WindowState state = TestWindow(Rolling(1)).state;
  RowViews rows(state);
  for (const double row_s : {0.0, 0.01, 0.0, 0.02}) {
    const Rigid3 expected = state.PoseAhead(1, state.Ahead(1, row_s));
    EXPECT_EQ(rows.At(1, row_s).T_odom_body.t, expected.t);
  }
}

TEST(PredictRay, NothingBehindTheCamera) {
  WindowProblem problem = TestWindow({});
  const Landmark& landmark = problem.landmarks[0];
  Eigen::Quaterniond& q = problem.state.frames[1].imu.T_odom_body.q;
  q = q * YawRotation(M_PI);
  RowViews rows(problem.state);
  EXPECT_FALSE(PredictRay(rows, PointInOdom(rows, landmark.point), landmark.rays[1]));
  const Vector3d p_odom = InOdom(rows, landmark.point);
  EXPECT_FALSE(PredictRayOnly(rows, p_odom, landmark.rays[1]));
  EXPECT_TRUE(std::isinf(RayError(rows, p_odom, landmark.rays[1])));
}

TEST(Triangulate, IsExactWithoutNoise) {
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    const WindowProblem problem = TestWindow(Rolling(seed));
    const Landmark& landmark = problem.landmarks[0];
    const auto found = Triangulate(problem.state, landmark.rays, 0);
    ASSERT_TRUE(found) << "seed " << seed;
    EXPECT_EQ(found->point.anchor, landmark.point.anchor);
    EXPECT_EQ(found->point.anchor_row_s, landmark.point.anchor_row_s);
    EXPECT_LT((found->point.ray_rho - landmark.point.ray_rho).norm(), 1e-6);
    EXPECT_LT(found->rms, 1e-3);
  }
}

TEST(Triangulate, CovarianceIsHonest) {
  std::mt19937_64 rng(4);
  const WindowProblem problem = TestWindow(Rolling(2));
  const Landmark& landmark = problem.landmarks[0];
  double nees = 0;
  constexpr int kTrials = 400;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::vector<FrameRay> rays = landmark.rays;
    for (FrameRay& seen : rays) {
      seen.ray += RandomVector(rng, seen.sigma).head<2>();
    }
    const auto found = Triangulate(problem.state, rays, 0);
    ASSERT_TRUE(found);
    const Vector3d e = found->point.ray_rho - landmark.point.ray_rho;
    nees += e.dot(found->covariance.llt().solve(e)) / kTrials;
  }
  EXPECT_NEAR(nees, 3, 0.5);  // mean of 400 chi-square(3): 3 +- 0.12
}

TEST(Triangulate, RefusesParallelRays) {
  WindowTestOptions options;
  options.landmarks = 1;
  WindowProblem problem = TestWindow(options);
  std::vector<FrameRay> rays = problem.landmarks[0].rays;
  for (WindowFrame& frame : problem.state.frames) {
    frame.imu.T_odom_body = problem.state.frames[0].imu.T_odom_body;
  }
  for (FrameRay& seen : rays) {
    seen.ray = rays[0].ray;
  }
  EXPECT_FALSE(Triangulate(problem.state, rays, 0));
}

}  // namespace
}  // namespace pangea::vio
