#include "global_ba/solver/ba_solver.h"

#include <algorithm>
#include <utility>

#include "global_ba/ba_factors.h"

namespace pangea {
namespace {

// Damping keeps position and yaw of the whole, which are unobservable, at their initial values.
constexpr double kFirstDamping = 1e-4;
constexpr int kMaxRetries = 8;

}  // namespace

BaSolver::BaSolver(const BaWorld& world, const BaOptions& options, const RobustLoss& loss)
    : loss_(loss),
      tolerance_(options.function_tolerance),
      damping_(kFirstDamping),
      state_{BaBlocks(world), world.landmarks},
      factors_(world, options, state_.blocks) {
  const BaBlocks& blocks = state_.blocks;
  std::vector<int> pose_variables, camera_variables;
  for (int i = 0; i < static_cast<int>(world.keyframes.size()); ++i) {
    camera_of_.push_back(world.keyframes[i].camera);
    pose_variables.push_back(blocks.block(blocks.Pose(i)).variable);
  }
  for (int i = 0; i < static_cast<int>(world.cameras.size()); ++i) {
    camera_variables.push_back(blocks.block(blocks.Camera(i)).variable);
  }
  landmarks_ = std::make_unique<EliminatedLandmarks>(world, pose_variables, camera_variables);
  std::vector<std::vector<int>> cliques = landmarks_->cliques();
  factors_.AddCliques(blocks, &cliques);
  equations_ = std::make_unique<BlockEquations>(blocks.VariableSizes(), cliques);
  cost_ = CostOf(state_);
}

std::vector<BaSolver::View> BaSolver::Views(const State& state) const {
  std::vector<View> views;
  views.reserve(camera_of_.size());
  for (int i = 0; i < static_cast<int>(camera_of_.size()); ++i) {
    const BaBlocks& blocks = state.blocks;
    views.emplace_back(PoseFromBlock(blocks[blocks.Pose(i)]),
                       PoseFromBlock(blocks[blocks.Camera(camera_of_[i])]));
  }
  return views;
}

double BaSolver::CostOf(const State& state) const {
  return factors_.Cost(state.blocks) + landmarks_->Cost(Views(state), state.landmarks, loss_);
}

std::optional<std::pair<BaSolver::State, double>> BaSolver::Step() {
  equations_->SetZero();
  landmarks_->AddTo(Views(state_), state_.landmarks, loss_, equations_.get());
  factors_.AddTo(state_.blocks, equations_.get());
  equations_->Damp(damping_);
  double predicted_decrease = landmarks_->Eliminate(damping_, equations_.get());
  const std::optional<Eigen::VectorXd> step = equations_->Solve();
  if (!step) {
    return std::nullopt;
  }
  predicted_decrease -= 0.5 * equations_->g().dot(*step);
  State moved = state_;
  moved.blocks.Move(*step, *equations_);
  landmarks_->Move(*step, *equations_, &moved.landmarks);
  return std::make_pair(std::move(moved), predicted_decrease);
}

BaSolver::Outcome BaSolver::Iterate() {
  for (int attempt = 0; attempt < kMaxRetries; ++attempt) {
    if (auto step = Step()) {
      auto& [moved, predicted_decrease] = *step;
      const double before = cost_, cost = CostOf(moved);
      if (cost <= before) {
        state_ = std::move(moved);
        cost_ = cost;
        damping_ /= 3;
        // Tests the damped step too: requiring a small undamped step takes a fifth longer, without
        // benefit.
        const double least = tolerance_ * before;
        return predicted_decrease < least || before - cost < least ? Outcome::kConverged
                                                                   : Outcome::kGoesOn;
      }
      if (predicted_decrease < 1e-12 * before) {
        return Outcome::kConverged;
      }
    }
    damping_ *= 10;
  }
  return Outcome::kStuck;
}

Eigen::Vector2d BaSolver::Residual(const BaObservation& seen) const {
  const BaBlocks& blocks = state_.blocks;
  return EliminatedLandmarks::Residual(
      seen,
      View(PoseFromBlock(blocks[blocks.Pose(seen.keyframe)]),
           PoseFromBlock(blocks[blocks.Camera(camera_of_[seen.keyframe])])),
      state_.landmarks[seen.landmark]);
}

void BaSolver::ReadBack(BaWorld* world) const {
  state_.blocks.ReadBack(world);
  world->landmarks = state_.landmarks;
}

}  // namespace pangea
