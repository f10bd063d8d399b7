#pragma once

// The residuals of a bundle adjustment without landmarks: inertial measurements, odometry edges and
// priors (ba_factors.h).

#include <ceres/cost_function.h>

#include <cstddef>
#include <memory>
#include <vector>

#include "block_equations/block_equations.h"
#include "global_ba/ba_options.h"
#include "global_ba/solver/ba_blocks.h"

namespace pangea {

// Prior sigmas of T_body_cam, about the odometry's last estimate.
inline constexpr double kCameraPositionSigma_m = 0.005;
inline constexpr double kCameraRotationSigma = 0.005;  // radians
// Weight w of covariance intersection (ba_problem.h); the IMU factor parallel to an edge has 1 - w.
// An edge without an IMU factor has weight 1.
inline constexpr double kEdgeWeight = 0.5;
// Relative sigma of the length of all edges of a metric map.
inline constexpr double kEdgeScaleSigma = 0.01;

class BlockFactors {
 public:
  BlockFactors(const BaWorld& world, const BaOptions& options, const BaBlocks& blocks);

  // Appends the clique of each factor to `cliques`; call once.
  void AddCliques(const BaBlocks& blocks, std::vector<std::vector<int>>* cliques);

  double Cost(const BaBlocks& blocks) const;
  void AddTo(const BaBlocks& blocks, BlockEquations* equations) const;

 private:
  struct Factor {
    std::unique_ptr<const ceres::CostFunction> cost;
    double weight = 1;
    std::vector<int> blocks;
    std::vector<int> members;  // per block: index in the factor's clique; -1: fixed
    size_t clique = 0;
  };

  void Add(const ceres::CostFunction* cost, double weight, std::vector<int> blocks);
  void AddInertial(const BaWorld& world, const BaOptions& options, const BaBlocks& blocks);
  void AddEdges(const BaWorld& world, const BaBlocks& blocks);
  void AddPriors(const BaWorld& world, const BaBlocks& blocks);
  static void AddFactor(const Factor& factor, const BaBlocks& blocks, BlockEquations* equations);

  std::vector<Factor> factors_;
};

}  // namespace pangea
