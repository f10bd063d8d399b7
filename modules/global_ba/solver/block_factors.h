#pragma once

// The residuals of a bundle adjustment between its blocks alone: inertial measurements, odometry
// edges, and what is known beforehand (ba_factors.h).

#include <ceres/cost_function.h>

#include <cstddef>
#include <memory>
#include <vector>

#include "global_ba/ba_options.h"
#include "global_ba/solver/ba_blocks.h"
#include "least_squares/block_equations.h"

namespace pangea {

// Of T_body_cam about the odometry's last estimate.
inline constexpr double kCameraPositionSigma_m = 0.005;
inline constexpr double kCameraRotationSigma = 0.005;  // radians
// Covariance intersection's w (ba_problem.h); the IMU factor beside an edge has the rest.
inline constexpr double kEdgeWeight = 0.5;
// Share by which all edges of a map may be too long.
inline constexpr double kEdgeScaleSigma = 0.01;

class BlockFactors {
 public:
  BlockFactors(const BaWorld& world, const BaOptions& options, const BaBlocks& blocks);

  // What each ties together, after those that are there; to be called once.
  void AddCliques(const BaBlocks& blocks, std::vector<std::vector<int>>* cliques);

  double Cost(const BaBlocks& blocks) const;
  void AddTo(const BaBlocks& blocks, BlockEquations* equations) const;

 private:
  struct Factor {
    std::unique_ptr<const ceres::CostFunction> cost;
    double weight = 1;
    std::vector<int> blocks;
    std::vector<int> members;  // of the factor's clique, for each block; -1 for what is held
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
