#include "global_ba/solver/ba_blocks.h"

#include "global_ba/ba_factors.h"

namespace pangea {
namespace {

constexpr int kPoseSize = 7, kPoseTangentSize = 6, kMotionSize = 9;

}  // namespace

BaBlocks::BaBlocks(const BaWorld& world)
    : num_keyframes_(static_cast<int>(world.keyframes.size())),
      num_cameras_(static_cast<int>(world.cameras.size())) {
  for (const BaKeyframe& keyframe : world.keyframes) {
    PoseToBlock(keyframe.state.T_map_body, Add(kPoseSize, kPoseTangentSize, keyframe.fixed));
  }
  for (const BaKeyframe& keyframe : world.keyframes) {
    Eigen::Map<MotionBlock>(Add(kMotionSize, kMotionSize, keyframe.fixed))
        << keyframe.state.v_map_body,
        keyframe.state.gyro_bias, keyframe.state.accel_bias;
  }
  for (const BaCamera& camera : world.cameras) {
    PoseToBlock(camera.T_body_cam, Add(kPoseSize, kPoseTangentSize, camera.fixed));
  }
  for (const BaCamera& camera : world.cameras) {
    *Add(1, 1, camera.fixed) = camera.fixed ? camera.edge_log_scale : 0;
  }
}

double* BaBlocks::Add(int size, int tangent_size, bool fixed) {
  const auto first = static_cast<int>(values_.size());
  blocks_.push_back({first, size, tangent_size, fixed ? kFixed : num_variables_++});
  values_.resize(values_.size() + size);
  return &values_[first];
}

std::vector<int> BaBlocks::VariableSizes() const {
  std::vector<int> sizes;
  for (const Block& block : blocks_) {
    if (block.variable != kFixed) {
      sizes.push_back(block.tangent_size);
    }
  }
  return sizes;
}

void BaBlocks::Move(const Eigen::VectorXd& step, const BlockEquations& equations) {
  for (const Block& block : blocks_) {
    if (block.variable == kFixed) {
      continue;
    }
    const auto moved = step.segment(equations.ColumnOf(block.variable), block.tangent_size);
    double* const values = &values_[block.first];
    if (block.size == kPoseSize) {
      PoseToBlock(PoseFromBlock(values).Plus(moved), values);
    } else {
      Eigen::Map<Eigen::VectorXd>(values, block.size) += moved;
    }
  }
}

void BaBlocks::ReadBack(BaWorld* world) const {
  for (int i = 0; i < num_keyframes_; ++i) {
    world->keyframes[i].state = StateFromBlocks((*this)[Pose(i)], (*this)[Motion(i)]);
  }
  for (int i = 0; i < num_cameras_; ++i) {
    world->cameras[i].T_body_cam = PoseFromBlock((*this)[Camera(i)]);
    world->cameras[i].edge_log_scale = *(*this)[EdgeLogScale(i)];
  }
}

}  // namespace pangea
