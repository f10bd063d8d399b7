#include "global_ba/solver/eliminated_landmarks.h"

#include <gtest/gtest.h>

#include "core/testing/numeric_jacobian.h"
#include "global_ba/ba_test_world.h"

namespace pangea {
namespace {

using Eigen::VectorXd;
using View = EliminatedLandmarks::View;

// A world with all keyframes and cameras free; errors are left perturbations of the initial values.
class EliminatedLandmarksTest : public ::testing::Test {
 protected:
  EliminatedLandmarksTest()
      : world_(MakeBaTestWorld({.keyframes = 4, .landmarks = 30, .outlier_share = 0.05}).start),
        num_keyframes_(static_cast<int>(world_.keyframes.size())),
        num_cameras_(static_cast<int>(world_.cameras.size())) {
    DropUnderobservedLandmarks(&world_);
  }

  static std::vector<int> Numbers(int first, int count) {
    std::vector<int> numbers;
    for (int i = 0; i < count; ++i) {
      numbers.push_back(first + i);
    }
    return numbers;
  }
  int NumVariables() const { return num_keyframes_ + num_cameras_; }
  EliminatedLandmarks Landmarks() const {
    return {world_, Numbers(0, num_keyframes_), Numbers(num_keyframes_, num_cameras_)};
  }
  std::vector<View> Views(const VectorXd& offset) const {
    std::vector<View> views;
    for (int i = 0; i < num_keyframes_; ++i) {
      const int camera = world_.keyframes[i].camera;
      views.emplace_back(
          world_.keyframes[i].state.T_map_body.Plus(offset.segment<6>(6 * i)),
          world_.cameras[camera].T_body_cam.Plus(offset.segment<6>(6 * (num_keyframes_ + camera))));
    }
    return views;
  }
  VectorXd None() const { return VectorXd::Zero(6 * NumVariables()); }

  BaWorld world_;
  int num_keyframes_, num_cameras_;
  const RobustLoss loss_{.kind = RobustLoss::Kind::kHuber, .scale = 2};
};

TEST_F(EliminatedLandmarksTest, GradientMatchesDifferencesOfTheCost) {
  EliminatedLandmarks landmarks = Landmarks();
  BlockEquations equations(std::vector<int>(NumVariables(), 6), landmarks.cliques());
  equations.SetZero();
  landmarks.AddTo(Views(None()), world_.landmarks, loss_, &equations);
  const Eigen::MatrixXd numeric =
      NumericJacobian(6 * NumVariables(), 1e-6, [&](const VectorXd& offset) -> VectorXd {
        return VectorXd::Constant(1, landmarks.Cost(Views(offset), world_.landmarks, loss_));
      });
  EXPECT_LT((equations.g().transpose() - numeric).cwiseAbs().maxCoeff(),
            1e-6 * numeric.cwiseAbs().maxCoeff());
}

// With fixed cameras, the step is a Gauss-Newton step of each landmark, exact if no residual is an
// outlier.
TEST_F(EliminatedLandmarksTest, OwnStepsLowerTheCostAsPredicted) {
  const RobustLoss quadratic{.kind = RobustLoss::Kind::kHuber, .scale = 1e6};
  EliminatedLandmarks landmarks = Landmarks();
  BlockEquations equations(std::vector<int>(NumVariables(), 6), landmarks.cliques());
  const std::vector<View> views = Views(None());
  std::vector<Eigen::Vector3d> points = world_.landmarks;
  double predicted = 0, before = 0;
  for (int iteration = 0; iteration < 4; ++iteration) {
    equations.SetZero();
    landmarks.AddTo(views, points, quadratic, &equations);
    predicted = landmarks.Eliminate(0, &equations);
    before = landmarks.Cost(views, points, quadratic);
    landmarks.Move(None(), equations, &points);
    EXPECT_LT(landmarks.Cost(views, points, quadratic), before);
  }
  EXPECT_NEAR((before - landmarks.Cost(views, points, quadratic)) / predicted, 1, 0.1);
}

}  // namespace
}  // namespace pangea
