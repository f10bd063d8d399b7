#include "vio/keyframes/keyframe_finisher.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "vio/window/landmarks/landmark_factor.h"
#include "vio/window/landmarks/point_geometry.h"
#include "vio/window/window_solver.h"

namespace pangea::vio {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;

// A depth is published only if its relative sigma is below this.
constexpr double kMaxRelativeSigma = 0.3;
constexpr size_t kMinRays = 4;
constexpr double kMaxRms = 2.0;          // sigmas
constexpr size_t kMinDepthsOfScale = 8;  // fewer do not separate the error of the scale

// Lower limit of the relative sigma of a depth.
constexpr double kMinRelativeSigma = 0.005;

struct SeenPoint {
  int32_t landmark_id = 0;
  Triangulated at;
  std::vector<FrameRay> rays;
};

// Jacobian of the inverse depth with respect to the window's error.
Eigen::RowVectorXd DepthJacobian(RowViews& views, const SeenPoint& seen) {
  const WindowState& state = views.state();
  const std::vector<FrameRay>& rays = seen.rays;
  const NormalEquations::Elimination elimination =
      EliminateLandmark(views, {seen.landmark_id, seen.at.point, rays});
  const Eigen::RowVectorXd gain = elimination.gain.row(2);
  Eigen::RowVectorXd J = Eigen::RowVectorXd::Zero(state.size());
  J.head<kCalibrationSize>() = gain.head<kCalibrationSize>();
  for (size_t i = 0; i < rays.size(); ++i) {
    const int at = state.FirstRow(rays[i].frame), column = elimination.RayColumn(i);
    J.segment<kPoseSize>(at) = gain.segment<kPoseSize>(column);
    if (state.frames[rays[i].frame].has_stamp_error()) {
      J[at + kStampError] = gain[column + kPoseSize];
    }
  }
  return J;
}

// Reorders: the window has rotation first, messages have translation first.
Matrix6d ExtrinsicsCovariance(const MatrixXd& P) {
  const std::array<int, 6> order = {3, 4, 5, 0, 1, 2};
  const Matrix6d covariance = P.block<6, 6>(kExtrinsics, kExtrinsics)(order, order);
  return 0.5 * (covariance + covariance.transpose());
}

// Triangulates the landmarks of one frame, anchored in it.
std::vector<SeenPoint> PointsSeen(const WindowState& state, const TrackHistory& history,
                                  int frame) {
  std::vector<SeenPoint> points;
  for (TrackHistory::Track& track : history.Tracks(state)) {
    const std::vector<FrameRay>& rays = track.rays;
    const auto own = std::find_if(rays.begin(), rays.end(),
                                  [frame](const FrameRay& ray) { return ray.frame == frame; });
    if (rays.size() < kMinRays || own == rays.end()) {
      continue;
    }
    const auto point = Triangulate(state, rays, static_cast<size_t>(own - rays.begin()));
    if (point && point->rms <= kMaxRms && point->point.ray_rho.z() > 0) {
      points.push_back({track.landmark_id, *point, std::move(track.rays)});
    }
  }
  return points;
}

// Adds the depths to publish, and the sigma of the scale from the errors that they have in common.
void AddDepths(const WindowState& state, const MatrixXd& P, const std::vector<SeenPoint>& points,
               FinishedKeyframe* keyframe) {
  const std::vector<int> rows = RowsOfPoses(state);
  RowViews views(state);
  MatrixXd J(points.size(), rows.size());
  for (size_t k = 0; k < points.size(); ++k) {
    J.row(static_cast<Eigen::Index>(k)) = DepthJacobian(views, points[k])(rows);
  }
  const MatrixXd P_rows = P(rows, rows);
  // Variance: from the rays, plus the errors of calibration and frames propagated by J.
  const Eigen::VectorXd of_window = (J * P_rows).cwiseProduct(J).rowwise().sum();
  Eigen::RowVectorXd scale = Eigen::RowVectorXd::Zero(J.cols());
  for (size_t k = 0; k < points.size(); ++k) {
    const auto row = static_cast<Eigen::Index>(k);
    const double rho = points[k].at.point.ray_rho.z();
    const double floor = kMinRelativeSigma * rho;
    const double variance = std::max(points[k].at.covariance(2, 2) + of_window[row], floor * floor);
    if (std::sqrt(variance) < kMaxRelativeSigma * rho) {
      scale += J.row(row) / rho;
      keyframe->landmarks.push_back({points[k].landmark_id, rho, variance});
    }
  }
  if (keyframe->landmarks.size() >= kMinDepthsOfScale) {
    keyframe->scale_sigma =
        std::sqrt(scale.dot(scale * P_rows)) / static_cast<double>(keyframe->landmarks.size());
  }
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
  const int at_i = state.FirstRow(i), at_j = state.FirstRow(j);
  MatrixXd P(12, 12);
  P << P_window.block<6, 6>(at_i, at_i), P_window.block<6, 6>(at_i, at_j),
      P_window.block<6, 6>(at_j, at_i), P_window.block<6, 6>(at_j, at_j);
  Matrix6d covariance = J * P * J.transpose();
  covariance = 0.5 * (covariance + covariance.transpose()).eval();
  // Two poses of a stationary body are almost equal: keep the matrix invertible (0.1 mm, 0.01
  // mrad).
  Eigen::Matrix<double, 6, 1> floor;
  floor << Vector3d::Constant(1e-8), Vector3d::Constant(1e-10);
  covariance.diagonal() += floor;
  return covariance;
}

FinishedKeyframe FinishKeyframe(const WindowState& state, const MatrixXd& P,
                                const TrackHistory& history, int index) {
  const WindowFrame& frame = state.frames[index];
  FinishedKeyframe keyframe;
  keyframe.utime = frame.utime;
  // The state belongs to the time offset at which the frame was added; move it to the present one.
  keyframe.T_odom_body = state.PoseAhead(index, state.Ahead(index, 0));
  keyframe.v_odom_body = frame.imu.v_odom_body;
  keyframe.motion = state.MotionAhead(index, state.Ahead(index, 0));
  keyframe.gyro_bias = frame.imu.gyro_bias;
  keyframe.accel_bias = frame.imu.accel_bias;
  const int at = state.FirstRow(index);
  keyframe.covariance = P.block<kFrameSize, kFrameSize>(at, at);
  keyframe.roll_pitch_covariance = P.block<2, 2>(at, at) + 1e-10 * Eigen::Matrix2d::Identity();
  AddDepths(state, P, PointsSeen(state, history, index), &keyframe);
  keyframe.T_body_cam_covariance = ExtrinsicsCovariance(P);
  return keyframe;
}

}  // namespace pangea::vio
