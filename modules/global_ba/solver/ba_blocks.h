#pragma once

// The parameter blocks of a bundle adjustment, except landmarks (ba_factors.h): each keyframe's
// pose and motion, each map's camera, and the log scale of each map's edges. Each block that is not
// fixed is a variable of the normal equations, in this order.

#include <Eigen/Core>
#include <vector>

#include "block_equations/block_equations.h"
#include "global_ba/ba_world.h"

namespace pangea {

class BaBlocks {
 public:
  static constexpr int kFixed = -1;
  struct Block {
    int first = 0, size = 0, tangent_size = 0;  // first, size: in values_
    int variable = kFixed;
  };

  explicit BaBlocks(const BaWorld& world);

  int Pose(int keyframe) const { return keyframe; }
  int Motion(int keyframe) const { return num_keyframes_ + keyframe; }
  int Camera(int camera) const { return 2 * num_keyframes_ + camera; }
  int EdgeLogScale(int camera) const { return 2 * num_keyframes_ + num_cameras_ + camera; }

  const Block& block(int index) const { return blocks_[index]; }
  const double* operator[](int index) const { return &values_[blocks_[index].first]; }
  // Number of columns of each variable.
  std::vector<int> VariableSizes() const;
  void Move(const Eigen::VectorXd& step, const BlockEquations& equations);
  void ReadBack(BaWorld* world) const;

 private:
  // Appends a block and returns its values, to be filled in.
  double* Add(int size, int tangent_size, bool fixed);

  int num_keyframes_ = 0, num_cameras_ = 0, num_variables_ = 0;
  std::vector<Block> blocks_;
  std::vector<double> values_;
};

}  // namespace pangea
