#include "vio/keyframes/keyframe_finisher.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>

#include "vio/window/landmark_factor.h"
#include "vio/window/point_geometry.h"

namespace pangea::vio {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;

// A depth is worth sending when it is known to this share of itself.
constexpr double kMaxRelativeSigma = 0.3;
constexpr size_t kMinRays = 4;
constexpr double kMaxRms = 2.0;  // sigmas

// Nothing is better known than this, whatever the window's rays say.
constexpr double kMinRelativeSigma = 0.005;

// What the window's error does to the inverse depth.
Eigen::RowVectorXd DepthJacobian(const WindowState& state, const Triangulated& point,
                                 const std::vector<FrameRay>& rays) {
  const NormalEquations::Elimination elimination = EliminateLandmark(state, {0, point.point, rays});
  const Eigen::RowVectorXd gain = elimination.gain.row(2);
  Eigen::RowVectorXd J = Eigen::RowVectorXd::Zero(state.size());
  J.head<kCalibrationSize>() = gain.head<kCalibrationSize>();
  for (size_t i = 0; i < rays.size(); ++i) {
    const int at = state.Offset(rays[i].frame), column = elimination.RayColumn(i);
    J.segment<kPoseSize>(at) = gain.segment<kPoseSize>(column);
    if (state.frames[rays[i].frame].has_stamp_error()) {
      J[at + kStampError] = gain[column + kPoseSize];
    }
  }
  return J;
}

// What is common to the relative errors of many depths is the scale's.
class ScaleError {
 public:
  void Add(const Eigen::RowVectorXd& J_inverse_depth, double inverse_depth) {
    sum_ = count_ == 0 ? Eigen::RowVectorXd(J_inverse_depth / inverse_depth)
                       : Eigen::RowVectorXd(sum_ + J_inverse_depth / inverse_depth);
    ++count_;
  }
  std::optional<double> Sigma(const MatrixXd& P) const {
    constexpr int kMinDepths = 8;  // fewer are not what is common
    return count_ < kMinDepths ? std::nullopt
                               : std::optional(std::sqrt(sum_.dot(sum_ * P)) / count_);
  }

 private:
  Eigen::RowVectorXd sum_;
  int count_ = 0;
};

// The window has rotation first, messages translation.
Matrix6d ExtrinsicsCovariance(const MatrixXd& P) {
  const std::array<int, 6> order = {3, 4, 5, 0, 1, 2};
  const Matrix6d covariance = P.block<6, 6>(kExtrinsics, kExtrinsics)(order, order);
  return 0.5 * (covariance + covariance.transpose());
}

std::optional<LandmarkDepth> DepthOf(int32_t id, const WindowState& state, const MatrixXd& P,
                                     const TrackHistory& history, int frame, ScaleError* scale) {
  const std::vector<FrameRay> rays = history.RaysOf(id, state, 0);
  const auto own = std::find_if(rays.begin(), rays.end(),
                                [frame](const FrameRay& ray) { return ray.frame == frame; });
  if (rays.size() < kMinRays || own == rays.end()) {
    return std::nullopt;
  }
  const auto point = Triangulate(state, rays, static_cast<size_t>(own - rays.begin()));
  if (!point || point->rms > kMaxRms) {
    return std::nullopt;
  }
  const double rho = point->point.ray_rho.z();
  const double floor = kMinRelativeSigma * rho;
  // Variance: that of the rays, and what the errors of calibration and frames do to it.
  const Eigen::RowVectorXd J = DepthJacobian(state, *point, rays);
  const double variance = std::max(point->covariance(2, 2) + J.dot(J * P), floor * floor);
  if (!(rho > 0) || !(std::sqrt(variance) < kMaxRelativeSigma * rho)) {
    return std::nullopt;
  }
  scale->Add(J, rho);
  return LandmarkDepth{id, rho, variance};
}

}  // namespace

Matrix6d RelativeCovariance(const WindowState& state, const MatrixXd& P_window, int i, int j) {
  // p_ij = R_i^T (p_j - p_i), with p = Exp(dtheta) p^ + xi for both.
  const Rigid3& T_i = state.frames[i].imu.T_odom_body;
  const Rigid3& T_j = state.frames[j].imu.T_odom_body;
  const Matrix3d R = T_i.R().transpose();
  MatrixXd J = MatrixXd::Zero(6, 12);  // (dtheta_i, xi_i, dtheta_j, xi_j)
  J.block<3, 3>(0, 0) = R * Hat(T_j.t);
  J.block<3, 3>(0, 3) = -R;
  J.block<3, 3>(0, 6) = -R * Hat(T_j.t);
  J.block<3, 3>(0, 9) = R;
  J.block<3, 3>(3, 0) = -R;
  J.block<3, 3>(3, 6) = R;
  const int at_i = state.Offset(i), at_j = state.Offset(j);
  MatrixXd P(12, 12);
  P << P_window.block<6, 6>(at_i, at_i), P_window.block<6, 6>(at_i, at_j),
      P_window.block<6, 6>(at_j, at_i), P_window.block<6, 6>(at_j, at_j);
  Matrix6d covariance = J * P * J.transpose();
  covariance = 0.5 * (covariance + covariance.transpose()).eval();
  // Two poses of a stationary body are all but one: keep the matrix invertible (0.1 mm, 0.01 mrad).
  Eigen::Matrix<double, 6, 1> floor;
  floor << Vector3d::Constant(1e-8), Vector3d::Constant(1e-10);
  covariance.diagonal() += floor;
  return covariance;
}

Matrix6d CorrectionCovariance(const Matrix6d& lost, const Rigid3& T_odom_i,
                              const Rigid3& T_odom_j) {
  const Matrix3d R = T_odom_i.R().transpose();
  Matrix6d J = Matrix6d::Zero();  // the columns of i in RelativeCovariance
  J.block<3, 3>(0, 0) = R * Hat(T_odom_j.t);
  J.block<3, 3>(0, 3) = -R;
  J.block<3, 3>(3, 0) = -R;
  const Matrix6d covariance = J * lost * J.transpose();
  // Differences of large numbers: rounding must not make it negative.
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(0.5 * (covariance + covariance.transpose()));
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).asDiagonal() *
         eigen.eigenvectors().transpose();
}

FinishedKeyframe FinishKeyframe(const WindowState& state, const MatrixXd& P,
                                const TrackHistory& history, int index) {
  const WindowFrame& frame = state.frames[index];
  FinishedKeyframe keyframe;
  keyframe.utime = frame.utime;
  // The state is where the body was by the time offset as the frame came.
  keyframe.T_odom_body = state.PoseAhead(index, state.Ahead(index, 0));
  keyframe.v_odom_body = frame.imu.v_odom_body;
  keyframe.omega_body = frame.omega_body;
  keyframe.gyro_bias = frame.imu.gyro_bias;
  keyframe.accel_bias = frame.imu.accel_bias;
  const int at = state.Offset(index);
  keyframe.covariance = P.block<kFrameSize, kFrameSize>(at, at);
  keyframe.roll_pitch_covariance = P.block<2, 2>(at, at) + 1e-10 * Eigen::Matrix2d::Identity();
  ScaleError scale;
  for (const auto& [id, ray] : history.Frame(frame.utime)) {
    if (const auto depth = DepthOf(id, state, P, history, index, &scale)) {
      keyframe.landmarks.push_back(*depth);
    }
  }
  keyframe.scale_sigma = scale.Sigma(P);
  keyframe.T_body_cam_covariance = ExtrinsicsCovariance(P);
  return keyframe;
}

}  // namespace pangea::vio
