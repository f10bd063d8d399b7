#include "global_ba/ba_problem.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <utility>

#include "global_ba/ba_factors.h"

namespace pangea {
namespace {

constexpr size_t kPoseSize = 7, kMotionSize = 9, kLandmarkSize = 3;
constexpr int kMinObservations = 2;

ceres::LossFunction* Weight(double weight) {
  return new ceres::ScaledLoss(nullptr, weight, ceres::TAKE_OWNERSHIP);
}

ceres::CostFunction* MakeEdgeFactor(const BaKeyframe& keyframe) {
  const BaEdge& edge = *keyframe.edge;
  return new EdgeFactor(EdgeResidual(
      edge.T_previous_this, edge.covariance,
      keyframe.unknown_scale > 0 ? EdgeResidual::Metres::kOdometry : EdgeResidual::Metres::kWorld));
}

}  // namespace

void DropLonelyLandmarks(BaWorld* world) {
  std::vector<int> count(world->landmarks.size(), 0);
  for (const BaObservation& seen : world->observations) {
    ++count[seen.landmark];
  }
  std::vector<int> new_index(count.size(), -1);
  std::vector<Eigen::Vector3d> kept;
  for (size_t i = 0; i < count.size(); ++i) {
    if (count[i] >= kMinObservations) {
      new_index[i] = static_cast<int>(kept.size());
      kept.push_back(world->landmarks[i]);
    }
  }
  std::erase_if(world->observations,
                [&](const BaObservation& seen) { return new_index[seen.landmark] < 0; });
  for (BaObservation& seen : world->observations) {
    seen.landmark = new_index[seen.landmark];
  }
  world->landmarks = std::move(kept);
}

struct BaProblem::Solver {
  Solver(const BaWorld& world, const BaOptions& options, ceres::LossFunction* loss);

  double* Pose(int keyframe) { return &blocks[kPoseSize * static_cast<size_t>(keyframe)]; }
  double* Motion(int keyframe) {
    return &blocks[motion_offset + kMotionSize * static_cast<size_t>(keyframe)];
  }
  double* Camera(int camera) {
    return &blocks[camera_offset + kPoseSize * static_cast<size_t>(camera)];
  }
  // How much longer a map's edges are than they should be, as a logarithm; a map has one camera.
  double* EdgeLogScale(int camera) { return &blocks[scale_offset + static_cast<size_t>(camera)]; }
  double* Landmark(int landmark) {
    return &blocks[landmark_offset + kLandmarkSize * static_cast<size_t>(landmark)];
  }

  void AddInertial(const BaWorld& world, const BaOptions& options);
  void AddEdges(const BaWorld& world, const BaOptions& options);
  void AddCameras(const BaWorld& world, const BaOptions& options);
  void AddLandmarks(const BaWorld& world, ceres::LossFunction* loss);

  // All parameters in one piece: Ceres orders blocks by address, and so the order, and with it the
  // last digit, is the same in every run.
  std::vector<double> blocks;
  size_t motion_offset = 0, camera_offset = 0, scale_offset = 0, landmark_offset = 0;
  ceres::Problem problem;
  ceres::Solver::Options options;
};

BaProblem::Solver::Solver(const BaWorld& world, const BaOptions& ba, ceres::LossFunction* loss) {
  motion_offset = kPoseSize * world.keyframes.size();
  camera_offset = motion_offset + kMotionSize * world.keyframes.size();
  scale_offset = camera_offset + kPoseSize * world.cameras.size();
  landmark_offset = scale_offset + world.cameras.size();
  blocks.resize(landmark_offset + kLandmarkSize * world.landmarks.size());
  options.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  AddInertial(world, ba);
  AddEdges(world, ba);
  AddCameras(world, ba);
  AddLandmarks(world, loss);
  options.linear_solver_type = ceres::SPARSE_SCHUR;
  options.sparse_linear_algebra_library_type = ceres::SUITE_SPARSE;
  options.num_threads = 1;
  options.function_tolerance = ba.function_tolerance;
  options.logging_type = ceres::SILENT;
}

void BaProblem::Solver::AddInertial(const BaWorld& world, const BaOptions& ba) {
  for (int i = 0; i < static_cast<int>(world.keyframes.size()); ++i) {
    const BaKeyframe& keyframe = world.keyframes[i];
    PoseToBlock(keyframe.imu.T_odom_body, Pose(i));
    Eigen::Map<MotionBlock>(Motion(i)) << keyframe.imu.v_odom_body, keyframe.imu.gyro_bias,
        keyframe.imu.accel_bias;
    problem.AddParameterBlock(Pose(i), kPoseSize, new RigidManifold);
    problem.AddParameterBlock(Motion(i), kMotionSize);
    options.linear_solver_ordering->AddElementToGroup(Pose(i), 1);
    options.linear_solver_ordering->AddElementToGroup(Motion(i), 1);
    if (keyframe.held) {
      problem.SetParameterBlockConstant(Pose(i));
      problem.SetParameterBlockConstant(Motion(i));
    }
    if (keyframe.previous >= 0 && keyframe.preintegration) {
      problem.AddResidualBlock(new PreintegrationFactor(*keyframe.preintegration, ba.imu),
                               Weight(keyframe.edge ? 1 - ba.edge_weight : 1),
                               Pose(keyframe.previous), Motion(keyframe.previous), Pose(i),
                               Motion(i));
    } else {
      problem.AddResidualBlock(new BiasPriorFactor(ba.gyro_bias_sigma, ba.accel_bias_sigma),
                               nullptr, Motion(i));
    }
  }
}

void BaProblem::Solver::AddEdges(const BaWorld& world, const BaOptions& ba) {
  std::vector<double> sigmas(world.cameras.size(), ba.edge_scale_sigma);
  for (int i = 0; i < static_cast<int>(world.keyframes.size()); ++i) {
    const BaKeyframe& keyframe = world.keyframes[i];
    if (keyframe.previous >= 0 && keyframe.edge) {
      problem.AddResidualBlock(MakeEdgeFactor(keyframe), Weight(ba.edge_weight),
                               Pose(keyframe.previous), Pose(i), EdgeLogScale(keyframe.camera));
    }
    sigmas[keyframe.camera] = std::max(sigmas[keyframe.camera], keyframe.unknown_scale);
  }
  for (int i = 0; i < static_cast<int>(world.cameras.size()); ++i) {
    problem.AddResidualBlock(new ScalePriorFactor(sigmas[i]), nullptr, EdgeLogScale(i));
    options.linear_solver_ordering->AddElementToGroup(EdgeLogScale(i), 1);
    if (world.cameras[i].held) {
      *EdgeLogScale(i) = world.cameras[i].edge_log_scale;
      problem.SetParameterBlockConstant(EdgeLogScale(i));
    }
  }
}

void BaProblem::Solver::AddCameras(const BaWorld& world, const BaOptions& ba) {
  for (int i = 0; i < static_cast<int>(world.cameras.size()); ++i) {
    const Rigid3& T_body_cam = world.cameras[i].T_body_cam;
    PoseToBlock(T_body_cam, Camera(i));
    problem.AddParameterBlock(Camera(i), kPoseSize, new RigidManifold);
    options.linear_solver_ordering->AddElementToGroup(Camera(i), 1);
    problem.AddResidualBlock(
        new CameraPriorFactor(T_body_cam, ba.camera_position_sigma, ba.camera_rotation_sigma),
        nullptr, Camera(i));
    if (world.cameras[i].held) {
      problem.SetParameterBlockConstant(Camera(i));
    }
  }
}

void BaProblem::Solver::AddLandmarks(const BaWorld& world, ceres::LossFunction* loss) {
  for (const BaObservation& seen : world.observations) {
    Eigen::Vector3d::Map(Landmark(seen.landmark)) = world.landmarks[seen.landmark];
    problem.AddResidualBlock(new LandmarkFactor(seen.ray, seen.sqrt_info), loss,
                             Pose(seen.keyframe), Landmark(seen.landmark),
                             Camera(world.keyframes[seen.keyframe].camera));
  }
  for (size_t i = 0; i < world.landmarks.size(); ++i) {
    options.linear_solver_ordering->AddElementToGroup(Landmark(static_cast<int>(i)), 0);
  }
}

BaProblem::BaProblem(BaWorld world, const BaOptions& options)
    : options_(options), world_(std::move(world)) {
  Begin();
}

BaProblem::~BaProblem() = default;

void BaProblem::Begin() {
  ceres::LossFunction* loss = nullptr;
  if (round_ == Round::kFindOutliers) {
    loss = new ceres::CauchyLoss(options_.loss_scale);
  } else {
    loss = new ceres::HuberLoss(options_.loss_scale);
  }
  solver_ = std::make_unique<Solver>(world_, options_, loss);
  iterations_ = 0;
}

bool BaProblem::Advance() {
  if (round_ == Round::kDone) {
    return false;
  }
  solver_->options.max_num_iterations = options_.iterations_a_piece;
  ceres::Solver::Summary summary;
  ceres::Solve(solver_->options, &solver_->problem, &summary);
  solver_->options.initial_trust_region_radius = summary.iterations.back().trust_region_radius;
  iterations_ += options_.iterations_a_piece;
  cost_ = summary.final_cost;
  ReadBack();
  if (summary.termination_type == ceres::NO_CONVERGENCE && iterations_ < options_.max_iterations) {
    return true;
  }
  if (round_ == Round::kEstimate || summary.termination_type == ceres::FAILURE) {
    round_ = Round::kDone;
    return false;
  }
  DropOutliers();
  round_ = Round::kEstimate;
  Begin();
  return true;
}

void BaProblem::ReadBack() {
  for (int i = 0; i < static_cast<int>(world_.keyframes.size()); ++i) {
    world_.keyframes[i].imu = StateFromBlocks(solver_->Pose(i), solver_->Motion(i));
  }
  for (int i = 0; i < static_cast<int>(world_.cameras.size()); ++i) {
    world_.cameras[i].T_body_cam = PoseFromBlock(solver_->Camera(i));
    world_.cameras[i].edge_log_scale = *solver_->EdgeLogScale(i);
  }
  for (int i = 0; i < static_cast<int>(world_.landmarks.size()); ++i) {
    world_.landmarks[i] = Eigen::Vector3d::Map(solver_->Landmark(i));
  }
}

void BaProblem::DropOutliers() {
  std::erase_if(world_.observations, [this](const BaObservation& seen) {
    const LandmarkFactor factor(seen.ray, seen.sqrt_info);
    const double* const blocks[] = {solver_->Pose(seen.keyframe), solver_->Landmark(seen.landmark),
                                    solver_->Camera(world_.keyframes[seen.keyframe].camera)};
    Eigen::Vector2d r;
    factor.Evaluate(blocks, r.data(), nullptr);
    return r.squaredNorm() > options_.max_chi2;
  });
  DropLonelyLandmarks(&world_);
}

}  // namespace pangea
