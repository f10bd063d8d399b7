#include "global_ba/solver/block_factors.h"

#include <algorithm>
#include <array>
#include <utility>

#include "global_ba/ba_factors.h"

namespace pangea {
namespace {

constexpr int kMaxBlocks = 4, kMaxRows = 15, kMaxColumns = 9;

using Jacobian =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor, kMaxRows, kMaxColumns>;
using Parameters = std::array<const double*, kMaxBlocks>;

Parameters ParametersOf(const std::vector<int>& indices, const BaBlocks& blocks) {
  Parameters parameters{};
  for (size_t k = 0; k < indices.size(); ++k) {
    parameters[k] = blocks[indices[k]];
  }
  return parameters;
}

}  // namespace

BlockFactors::BlockFactors(const BaWorld& world, const BaOptions& options, const BaBlocks& blocks) {
  AddInertial(world, options, blocks);
  AddEdges(world, blocks);
  AddPriors(world, blocks);
}

void BlockFactors::Add(const ceres::CostFunction* cost, double weight, std::vector<int> blocks) {
  factors_.push_back(
      {std::unique_ptr<const ceres::CostFunction>(cost), weight, std::move(blocks), {}, 0});
}

void BlockFactors::AddInertial(const BaWorld& world, const BaOptions& options,
                               const BaBlocks& blocks) {
  for (int i = 0; i < static_cast<int>(world.keyframes.size()); ++i) {
    const BaKeyframe& keyframe = world.keyframes[i];
    const int previous = keyframe.previous;
    if (previous >= 0 && keyframe.preintegration) {
      Add(new PreintegrationFactor(*keyframe.preintegration, options.imu),
          keyframe.edge ? 1 - kEdgeWeight : 1,
          {blocks.Pose(previous), blocks.Motion(previous), blocks.Pose(i), blocks.Motion(i)});
    } else {
      Add(new BiasPriorFactor(options.gyro_bias_sigma, options.accel_bias_sigma), 1,
          {blocks.Motion(i)});
    }
  }
}

void BlockFactors::AddEdges(const BaWorld& world, const BaBlocks& blocks) {
  for (int i = 0; i < static_cast<int>(world.keyframes.size()); ++i) {
    const BaKeyframe& keyframe = world.keyframes[i];
    if (keyframe.previous >= 0 && keyframe.edge) {
      const bool has_imu = keyframe.preintegration.has_value();
      // Without the IMU, edges may alone determine the scale (core/least_squares/edge_residual.h).
      const auto scale = has_imu && keyframe.unknown_scale == 0 ? EdgeResidual::Scale::kMap
                                                                : EdgeResidual::Scale::kOdometry;
      const BaEdge& edge = *keyframe.edge;
      Add(new EdgeFactor(EdgeResidual(edge.T_previous_this, edge.covariance, scale)),
          has_imu ? kEdgeWeight : 1,
          {blocks.Pose(keyframe.previous), blocks.Pose(i), blocks.EdgeLogScale(keyframe.camera)});
    }
  }
}

void BlockFactors::AddPriors(const BaWorld& world, const BaBlocks& blocks) {
  std::vector<double> sigmas(world.cameras.size(), kEdgeScaleSigma);
  for (const BaKeyframe& keyframe : world.keyframes) {
    sigmas[keyframe.camera] = std::max(sigmas[keyframe.camera], keyframe.unknown_scale);
  }
  for (int i = 0; i < static_cast<int>(world.cameras.size()); ++i) {
    Add(new ScalePriorFactor(sigmas[i]), 1, {blocks.EdgeLogScale(i)});
    Add(new CameraPriorFactor(world.cameras[i].T_body_cam_prior, kCameraPositionSigma_m,
                              kCameraRotationSigma),
        1, {blocks.Camera(i)});
  }
}

void BlockFactors::AddCliques(const BaBlocks& blocks, std::vector<std::vector<int>>* cliques) {
  for (Factor& factor : factors_) {
    std::vector<int> clique;
    for (const int index : factor.blocks) {
      if (blocks.block(index).variable != BaBlocks::kFixed) {
        clique.push_back(blocks.block(index).variable);
      }
    }
    std::ranges::sort(clique);
    for (const int index : factor.blocks) {
      const auto member = std::ranges::find(clique, blocks.block(index).variable);
      factor.members.push_back(member == clique.end() ? BaBlocks::kFixed
                                                      : static_cast<int>(member - clique.begin()));
    }
    factor.clique = cliques->size();
    cliques->push_back(std::move(clique));
  }
}

double BlockFactors::Cost(const BaBlocks& blocks) const {
  double cost = 0;
  for (const Factor& factor : factors_) {
    Eigen::Matrix<double, kMaxRows, 1> r;
    factor.cost->Evaluate(ParametersOf(factor.blocks, blocks).data(), r.data(), nullptr);
    cost += 0.5 * factor.weight * r.head(factor.cost->num_residuals()).squaredNorm();
  }
  return cost;
}

void BlockFactors::AddTo(const BaBlocks& blocks, BlockEquations* equations) const {
  for (const Factor& factor : factors_) {
    AddFactor(factor, blocks, equations);
  }
}

void BlockFactors::AddFactor(const Factor& factor, const BaBlocks& blocks,
                             BlockEquations* equations) {
  const int num_rows = factor.cost->num_residuals();
  Eigen::Matrix<double, kMaxRows, 1> residuals;
  std::array<Jacobian, kMaxBlocks> J;
  std::array<double*, kMaxBlocks> jacobians{};
  const size_t count = factor.blocks.size();
  for (size_t k = 0; k < count; ++k) {
    if (factor.members[k] != BaBlocks::kFixed) {
      J[k].resize(num_rows, blocks.block(factor.blocks[k]).size);
      jacobians[k] = J[k].data();
    }
  }
  factor.cost->Evaluate(ParametersOf(factor.blocks, blocks).data(), residuals.data(),
                        jacobians.data());
  const auto r = residuals.head(num_rows);
  for (size_t a = 0; a < count; ++a) {
    if (factor.members[a] == BaBlocks::kFixed) {
      continue;
    }
    const BaBlocks::Block& block_a = blocks.block(factor.blocks[a]);
    const auto J_a = J[a].leftCols(block_a.tangent_size);
    equations->g().segment(equations->ColumnOf(block_a.variable), block_a.tangent_size) +=
        factor.weight * (J_a.transpose() * r);
    for (size_t b = 0; b < count; ++b) {
      if (factor.members[b] != BaBlocks::kFixed && factor.members[b] <= factor.members[a]) {
        const auto J_b = J[b].leftCols(blocks.block(factor.blocks[b]).tangent_size);
        equations->Add(factor.clique, factor.members[a], factor.members[b],
                       factor.weight * (J_a.transpose() * J_b));
      }
    }
  }
}

}  // namespace pangea
