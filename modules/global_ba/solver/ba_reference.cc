#include "global_ba/solver/ba_reference.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <vector>

#include "global_ba/ba_factors.h"
#include "global_ba/solver/block_factors.h"

namespace pangea {
namespace {

constexpr double kMinDepth_m = 0.05;
constexpr double kBehind = 20;  // sigmas

template <int kRows, int kColumns>
Eigen::Map<Eigen::Matrix<double, kRows, kColumns, Eigen::RowMajor>> Derivative(double* jacobian) {
  return Eigen::Map<Eigen::Matrix<double, kRows, kColumns, Eigen::RowMajor>>(jacobian);
}

class Reference {
 public:
  Reference(const BaOptions& options, BaWorld* world) : options_(options), world_(world) {
    const size_t keyframes = world->keyframes.size(), cameras = world->cameras.size();
    poses_.resize(7 * keyframes);
    motions_.resize(9 * keyframes);
    cameras_.resize(7 * cameras);
    scales_.resize(cameras);
  }

  double Solve(ceres::LossFunction* loss) {
    AddKeyframes();
    AddCameras();
    for (const BaObservation& seen : world_->observations) {
      problem_.AddResidualBlock(new LandmarkFactor(seen.ray, seen.sqrt_info), loss,
                                Pose(seen.keyframe), world_->landmarks[seen.landmark].data(),
                                Camera(world_->keyframes[seen.keyframe].camera));
    }
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::SPARSE_SCHUR;
    options.max_num_iterations = 200;
    options.function_tolerance = 1e-14;
    options.parameter_tolerance = 1e-14;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem_, &summary);
    ReadBack();
    return summary.final_cost;
  }

 private:
  double* Pose(int keyframe) { return &poses_[7 * static_cast<size_t>(keyframe)]; }
  double* Motion(int keyframe) { return &motions_[9 * static_cast<size_t>(keyframe)]; }
  double* Camera(int camera) { return &cameras_[7 * static_cast<size_t>(camera)]; }

  static ceres::LossFunction* Weight(double weight) {
    return new ceres::ScaledLoss(nullptr, weight, ceres::TAKE_OWNERSHIP);
  }

  void AddKeyframes() {
    for (int i = 0; i < static_cast<int>(world_->keyframes.size()); ++i) {
      const BaKeyframe& keyframe = world_->keyframes[i];
      PoseToBlock(keyframe.state.T_map_body, Pose(i));
      Eigen::Map<MotionBlock>(Motion(i)) << keyframe.state.v_map_body, keyframe.state.gyro_bias,
          keyframe.state.accel_bias;
      problem_.AddParameterBlock(Pose(i), 7, new RigidManifold);
      problem_.AddParameterBlock(Motion(i), 9);
      if (keyframe.fixed) {
        problem_.SetParameterBlockConstant(Pose(i));
        problem_.SetParameterBlockConstant(Motion(i));
      }
      AddFactors(i);
    }
  }

  void AddFactors(int i) {
    const BaKeyframe& keyframe = world_->keyframes[i];
    const int previous = keyframe.previous;
    const bool has_imu = keyframe.preintegration.has_value();
    if (has_imu) {
      problem_.AddResidualBlock(new PreintegrationFactor(*keyframe.preintegration, options_.imu),
                                Weight(keyframe.edge ? 1 - kEdgeWeight : 1), Pose(previous),
                                Motion(previous), Pose(i), Motion(i));
    } else {
      problem_.AddResidualBlock(
          new BiasPriorFactor(options_.gyro_bias_sigma, options_.accel_bias_sigma), nullptr,
          Motion(i));
    }
    if (const auto& edge = keyframe.edge) {
      const auto scale = has_imu ? EdgeResidual::Scale::kMap : EdgeResidual::Scale::kOdometry;
      problem_.AddResidualBlock(
          new EdgeFactor(EdgeResidual(edge->T_previous_this, edge->covariance, scale)),
          Weight(has_imu ? kEdgeWeight : 1), Pose(previous), Pose(i), &scales_[keyframe.camera]);
    }
  }

  void AddCameras() {
    for (int i = 0; i < static_cast<int>(world_->cameras.size()); ++i) {
      const BaCamera& camera = world_->cameras[i];
      PoseToBlock(camera.T_body_cam, Camera(i));
      problem_.AddParameterBlock(Camera(i), 7, new RigidManifold);
      problem_.AddResidualBlock(new CameraPriorFactor(camera.T_body_cam_prior,
                                                      kCameraPositionSigma_m, kCameraRotationSigma),
                                nullptr, Camera(i));
      problem_.AddResidualBlock(new ScalePriorFactor(kEdgeScaleSigma), nullptr, &scales_[i]);
      if (camera.fixed) {
        scales_[i] = camera.edge_log_scale;
        problem_.SetParameterBlockConstant(Camera(i));
        problem_.SetParameterBlockConstant(&scales_[i]);
      }
    }
  }

  void ReadBack() {
    for (int i = 0; i < static_cast<int>(world_->keyframes.size()); ++i) {
      world_->keyframes[i].state = StateFromBlocks(Pose(i), Motion(i));
    }
    for (int i = 0; i < static_cast<int>(world_->cameras.size()); ++i) {
      world_->cameras[i].T_body_cam = PoseFromBlock(Camera(i));
      world_->cameras[i].edge_log_scale = scales_[i];
    }
  }

  const BaOptions& options_;
  BaWorld* world_;
  std::vector<double> poses_, motions_, cameras_, scales_;
  ceres::Problem problem_;
};

}  // namespace

bool RigidManifold::Plus(const double* x, const double* delta, double* x_plus_delta) const {
  PoseToBlock(PoseFromBlock(x).Plus(Eigen::Map<const Vector6d>(delta)), x_plus_delta);
  return true;
}

bool RigidManifold::PlusJacobian(const double*, double* jacobian) const {
  Eigen::Map<Eigen::Matrix<double, 7, 6, Eigen::RowMajor>>(jacobian).setIdentity();
  return true;
}

bool RigidManifold::Minus(const double* y, const double* x, double* y_minus_x) const {
  Eigen::Map<Vector6d> difference(y_minus_x);
  difference = PoseFromBlock(y).Minus(PoseFromBlock(x));
  return true;
}

bool RigidManifold::MinusJacobian(const double*, double* jacobian) const {
  Eigen::Map<Eigen::Matrix<double, 6, 7, Eigen::RowMajor>>(jacobian).setIdentity();
  return true;
}

bool LandmarkFactor::Evaluate(double const* const* parameters, double* residuals,
                              double** jacobians) const {
  const Rigid3 T_map_body = PoseFromBlock(parameters[0]);
  const Rigid3 T_body_cam = PoseFromBlock(parameters[2]);
  const Eigen::Vector3d arm_map = Eigen::Vector3d::Map(parameters[1]) - T_map_body.t;
  const Eigen::Matrix3d R_body_map = T_map_body.R().transpose();
  const Eigen::Matrix3d R_cam_body = T_body_cam.R().transpose();
  const Eigen::Vector3d arm_body = R_body_map * arm_map - T_body_cam.t;
  const Eigen::Vector3d p_cam = R_cam_body * arm_body;
  Eigen::Map<Eigen::Vector2d> r(residuals);
  const bool in_front = p_cam.z() > kMinDepth_m;
  const double inverse_z = in_front ? 1 / p_cam.z() : 0;
  const Eigen::Vector2d seen = p_cam.head<2>() * inverse_z;
  if (in_front) {
    r = sqrt_info_ * (seen - ray_);
  } else {
    r.setConstant(kBehind);
  }
  if (jacobians == nullptr) {
    return true;
  }
  Eigen::Matrix<double, 2, 3> J_project;
  J_project << inverse_z, 0, -seen.x() * inverse_z, 0, inverse_z, -seen.y() * inverse_z;
  const Eigen::Matrix<double, 2, 3> J_body = sqrt_info_ * J_project * R_cam_body;
  const Eigen::Matrix<double, 2, 3> J_map = J_body * R_body_map;
  if (jacobians[0] != nullptr) {
    Derivative<2, 7>(jacobians[0]) << -J_map, J_map * Hat(arm_map), Eigen::Vector2d::Zero();
  }
  if (jacobians[1] != nullptr) {
    Derivative<2, 3>(jacobians[1]) = J_map;
  }
  if (jacobians[2] != nullptr) {
    Derivative<2, 7>(jacobians[2]) << -J_body, J_body * Hat(arm_body), Eigen::Vector2d::Zero();
  }
  return true;
}

double SolveByCeres(const BaOptions& options, ceres::LossFunction* loss, BaWorld* world) {
  return Reference(options, world).Solve(loss);
}

}  // namespace pangea
