#pragma once

// Levenberg-Marquardt on a bundle adjustment's world: landmarks are eliminated
// (eliminated_landmarks.h), and the rest is solved by sparse Cholesky
// (block_equations/block_equations.h).

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "block_equations/block_equations.h"
#include "core/least_squares/robust_loss.h"
#include "global_ba/ba_options.h"
#include "global_ba/solver/ba_blocks.h"
#include "global_ba/solver/block_factors.h"
#include "global_ba/solver/eliminated_landmarks.h"

namespace pangea {

class BaSolver {
 public:
  BaSolver(const BaWorld& world, const BaOptions& options, const RobustLoss& loss);

  enum class Outcome { kGoesOn, kConverged, kStuck };
  // One iteration. kStuck: no step lowers the cost, although the linearisation predicts one.
  Outcome Iterate();

  double cost() const { return cost_; }
  // Whitened residual of an observation.
  Eigen::Vector2d Residual(const BaObservation& seen) const;
  void ReadBack(BaWorld* world) const;

 private:
  using View = EliminatedLandmarks::View;
  struct State {
    BaBlocks blocks;
    std::vector<Eigen::Vector3d> landmarks;
  };

  std::vector<View> Views(const State& state) const;
  double CostOf(const State& state) const;
  // The state after a step, and the predicted decrease of the cost; empty if the solve fails.
  std::optional<std::pair<State, double>> Step();

  RobustLoss loss_;
  double tolerance_ = 0;  // relative decrease of the cost at convergence
  double damping_ = 0;
  std::vector<int> camera_of_;  // by keyframe
  State state_;
  BlockFactors factors_;
  std::unique_ptr<EliminatedLandmarks> landmarks_;
  std::unique_ptr<BlockEquations> equations_;
  double cost_ = 0;
};

}  // namespace pangea
