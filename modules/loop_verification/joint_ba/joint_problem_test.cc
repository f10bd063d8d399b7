#include "loop_verification/joint_ba/joint_problem.h"

#include <ceres/ceres.h>
#include <ceres/covariance.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "loop_verification/joint_ba/joint_ba_test_world.h"

namespace pangea {
namespace {

// The same problem for Ceres, with independent formulas and numeric derivatives. Poses are
// parametrised by tangents at the state.
class Reference {
 public:
  Reference(const JointProblem& problem, const JointState& start, RobustLoss::Kind loss)
      : problem_(problem), start_(start), poses_(start.T_w_body.size()), points_(start.points) {
    log_scale_ = start.log_scale;
    for (auto& pose : poses_) {
      pose.fill(0);
      ceres_.AddParameterBlock(pose.data(), 6);
    }
    ceres_.SetParameterBlockConstant(poses_.back().data());
    for (const int side : {kSideM, kSideC}) {
      Add<1, 1>([sigma = problem.ScaleSigma(side)](const double* kappa,
                                                   double* r) { r[0] = kappa[0] / sigma; },
                nullptr, &log_scale_[side]);
    }
    for (const JointProblem::Edge& edge : problem.edges()) {
      Add<6, 6, 6, 1>(
          [this, &edge](const double* from, const double* to, const double* kappa, double* r) {
            Eigen::Map<Vector6d>(r, 6) =
                edge.residual.Evaluate(Pose(edge.from, from), Pose(edge.to, to), kappa[0]);
          },
          nullptr, poses_[edge.from].data(), poses_[edge.to].data(), &log_scale_[edge.side]);
    }
    for (size_t p = 0; p < points_.size(); ++p) {
      AddPoint(problem.points()[p], points_[p].data(), loss);
    }
  }

  double Solve() {
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_QR;
    options.max_num_iterations = 100;
    options.function_tolerance = 1e-12;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &ceres_, &summary);
    EXPECT_EQ(summary.termination_type, ceres::CONVERGENCE);
    return summary.final_cost;
  }

  Rigid3 NewestC() const { return Pose(0, poses_[0].data()); }

  Matrix6d CovarianceOfNewestC() {
    ceres::Covariance covariance({});
    const std::vector<std::pair<const double*, const double*>> newest = {
        {poses_[0].data(), poses_[0].data()}};
    EXPECT_TRUE(covariance.Compute(newest, &ceres_));
    Eigen::Matrix<double, 6, 6, Eigen::RowMajor> block;
    covariance.GetCovarianceBlock(poses_[0].data(), poses_[0].data(), block.data());
    return block;
  }

 private:
  Rigid3 Pose(int frame, const double* tangent) const {
    return start_.T_w_body[frame].Plus(Eigen::Map<const Vector6d>(tangent));
  }

  template <int kResiduals, int... kBlocks, typename Residual, typename... Blocks>
  void Add(Residual residual, ceres::LossFunction* loss, Blocks... blocks) {
    const auto evaluate = [residual](auto... arguments) {
      residual(arguments...);
      return true;
    };
    using Evaluate = decltype(evaluate);
    ceres_.AddResidualBlock(
        new ceres::NumericDiffCostFunction<Evaluate, ceres::CENTRAL, kResiduals, kBlocks...>(
            new Evaluate(evaluate)),
        loss, blocks...);
  }

  void AddPoint(const HostedPoint& hosted, double* point, RobustLoss::Kind kind) {
    Add<3, 3, 1>(
        [&hosted](const double* at, const double* kappa, double* r) {
          Eigen::Map<Eigen::Vector2d>(r, 2) =
              hosted.sqrt_info * (Eigen::Vector2d(at[0], at[1]) - hosted.ray);
          r[2] = (at[2] - std::exp(-kappa[0]) * hosted.inverse_depth) / hosted.inverse_depth_sigma;
        },
        nullptr, point, &log_scale_[hosted.side]);
    for (const HostedPoint::Observation& seen : hosted.seen) {
      ceres::LossFunction* loss = nullptr;
      if (kind != RobustLoss::Kind::kNone) {
        loss = kind == RobustLoss::Kind::kHuber
                   ? static_cast<ceres::LossFunction*>(new ceres::HuberLoss(2))
                   : new ceres::CauchyLoss(2);
      }
      Add<2, 6, 6, 3>(
          [this, &hosted, &seen](const double* host, const double* target, const double* at,
                                 double* r) {
            const auto& T_body_cam = problem_.T_body_cam();
            const Eigen::Vector3d p_w = Pose(hosted.host, host) * T_body_cam[hosted.host] *
                                        Eigen::Vector3d(at[0] / at[2], at[1] / at[2], 1 / at[2]);
            const Eigen::Vector3d p_cam =
                (Pose(seen.frame, target) * T_body_cam[seen.frame]).Inverse() * p_w;
            Eigen::Map<Eigen::Vector2d>(r, 2) = seen.sqrt_info * (p_cam.hnormalized() - seen.ray);
          },
          loss, poses_[hosted.host].data(), poses_[seen.frame].data(), point);
    }
  }

  const JointProblem& problem_;
  JointState start_;
  std::vector<std::array<double, 6>> poses_;
  std::array<double, 2> log_scale_{};
  std::vector<Eigen::Vector3d> points_;
  ceres::Problem ceres_;
};

class JointProblemTest : public JointBaTestWindows {
 protected:
  // Start from a realistic initial guess.
  JointProblemTest() {
    T_m_c_ = Rigid3(ExpSo3({0.004, -0.003, 0.01}), {0.03, -0.02, 0.04}) * T_m_c_;
  }

  void SpoilSomeMatches() {
    for (size_t i = 0; i + 7 < matches_.size(); i += 40) {
      matches_[i].observed = matches_[i + 7].observed;
    }
  }
};

TEST_F(JointProblemTest, SolvesAsCeresDoes) {
  options_.iterations = 20;
  for (const auto loss :
       {RobustLoss::Kind::kNone, RobustLoss::Kind::kHuber, RobustLoss::Kind::kCauchy}) {
    if (loss == RobustLoss::Kind::kHuber) {
      SpoilSomeMatches();
    }
    JointProblem problem(windows_, T_m_c_, options_);
    const std::vector<bool> all(matches_.size(), true);
    const RobustLoss robust{loss, 2.0};
    ASSERT_TRUE(problem.Solve(matches_, all, robust));
    // Start from the initial poses; the points start at the problem's own initial values.
    JointProblem start(windows_, T_m_c_, options_);
    JointState state = start.state();
    for (const HostedPoint& point : problem.points()) {
      state.points.emplace_back(point.ray.x(), point.ray.y(), point.inverse_depth);
    }
    Reference reference(problem, state, loss);
    const double cost = reference.Solve();
    EXPECT_NEAR(problem.Cost(problem.state(), robust) / cost, 1, 1e-4);
    const auto marginals =
        problem.MarginalsOfNewestC(matches_, all, JointBaCovariances::kAlsoOfFewer);
    ASSERT_TRUE(marginals);
    const Vector6d difference = problem.NewestPose(kSideC).Minus(reference.NewestC());
    // A twentieth of a sigma.
    EXPECT_LT(difference.dot(marginals->all.inverse() * difference), 2.5e-3);
    if (loss == RobustLoss::Kind::kNone) {
      const Matrix6d covariance = reference.CovarianceOfNewestC();
      EXPECT_LT((marginals->all - covariance).norm(), 1e-3 * covariance.norm());
    }
  }
}

}  // namespace
}  // namespace pangea
