#include "loop_verification/correspondences/point_observation.h"

#include <Eigen/Cholesky>
#include <limits>

namespace pangea {
namespace {

constexpr double kMinDepth = 0.05;  // metres; nearer points are no landmarks

}  // namespace

PointObservation MakeObservation(const WindowPair& windows, const PointMatch& match,
                                 double pixel_sigma) {
  const Window& observer = windows.Observer(match.direction);
  const WindowLandmark& landmark = windows.Holder(match.direction).landmarks[match.landmark];
  const KeyframeView& view = *observer.frames[match.observed.frame];
  PointObservation observation;
  observation.direction = match.direction;
  observation.p_w = landmark.p_w;
  observation.depth_sigma_w = landmark.depth_sigma_w;
  observation.T_cam_w = observer.T_w_cam[match.observed.frame].Inverse();
  observation.R_cam_w = observation.T_cam_w.R();
  observation.ray = view.ray(match.observed.corner);
  observation.sqrt_info = view.pixel_jacobian(match.observed.corner) /
                          CornerSigma(observer.corner(match.observed), pixel_sigma);
  return observation;
}

std::optional<WhitenedResidual> Residual(const PointObservation& observation, const Rigid3& T_m_c,
                                         const Eigen::Matrix3d& R, Eigen::Matrix<double, 2, 6>* J) {
  const bool forward = observation.direction == Direction::kForward;
  // The point in the observing window: y = X^-1 p or X p.
  const Eigen::Vector3d y = forward ? Eigen::Vector3d(R.transpose() * (observation.p_w - T_m_c.t))
                                    : Eigen::Vector3d(R * observation.p_w + T_m_c.t);
  const Eigen::Vector3d p_cam = observation.R_cam_w * y + observation.T_cam_w.t;
  if (p_cam.z() < kMinDepth) {
    return std::nullopt;
  }
  const double inv_z = 1.0 / p_cam.z();
  const Eigen::Vector2d xy = p_cam.head<2>() * inv_z;
  Eigen::Matrix<double, 2, 3> J_project;
  J_project << inv_z, 0, -xy.x() * inv_z, 0, inv_z, -xy.y() * inv_z;
  const Eigen::Matrix<double, 2, 3> J_y = observation.sqrt_info * J_project * observation.R_cam_w;
  const Eigen::Matrix3d R_observer_holder = forward ? Eigen::Matrix3d(R.transpose()) : R;
  if (J != nullptr) {
    // p' = p + dp, R' = Exp(dtheta) R: y' = R^T (p - t - dp - dtheta x (p - t)) or
    // R p + t + dp + dtheta x R p.
    if (forward) {
      J->leftCols<3>() = -J_y * R.transpose();
      J->rightCols<3>() = J_y * R.transpose() * Hat(observation.p_w - T_m_c.t);
    } else {
      J->leftCols<3>() = J_y;
      J->rightCols<3>() = -J_y * Hat(R * observation.p_w);
    }
  }
  return WhitenedResidual{observation.sqrt_info * (xy - observation.ray),
                          J_y * (R_observer_holder * observation.depth_sigma_w)};
}

double Chi2(const std::optional<WhitenedResidual>& residual, double extra_var) {
  if (!residual) {
    return std::numeric_limits<double>::infinity();
  }
  // r^T (v I + u u^T)^-1 r by Sherman and Morrison.
  const double v = 1.0 + extra_var;
  const double along = residual->r.dot(residual->depth_sigma);
  return (residual->r.squaredNorm() - along * along / (v + residual->depth_sigma.squaredNorm())) /
         v;
}

PoseEstimate RefinePose(const std::vector<PointObservation>& observations, const Rigid3& T_m_c,
                        double tilt_sigma) {
  constexpr int kIterations = 8;
  constexpr double kCauchy2 = 9.0;  // squared scale of the robust loss, sigma^2
  PoseEstimate estimate{T_m_c, Matrix6d::Identity()};
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    Matrix6d H = Matrix6d::Identity() * 1e-9;
    Vector6d b = Vector6d::Zero();
    const Eigen::Matrix3d R_m_c = estimate.T_m_c.R();
    for (const PointObservation& observation : observations) {
      Eigen::Matrix<double, 2, 6> J;
      const auto residual = Residual(observation, estimate.T_m_c, R_m_c, &J);
      if (!residual) {
        continue;
      }
      Eigen::Matrix2d covariance = residual->depth_sigma * residual->depth_sigma.transpose();
      covariance.diagonal().array() += 1.0;
      const Eigen::Matrix2d information = covariance.inverse();
      const double chi2 = residual->r.dot(information * residual->r);
      const double weight = 1.0 / (1.0 + chi2 / kCauchy2);
      H += weight * J.transpose() * information * J;
      b -= weight * J.transpose() * (information * residual->r);
    }
    // Both frames have z up: (R e_z).xy = 0.
    const Eigen::Vector3d up = estimate.T_m_c.q * Eigen::Vector3d::UnitZ();
    Eigen::Matrix<double, 2, 6> J_tilt = Eigen::Matrix<double, 2, 6>::Zero();
    J_tilt.rightCols<3>() = -Hat(up).topRows<2>();
    const double tilt_information = 1.0 / (tilt_sigma * tilt_sigma);
    H += tilt_information * J_tilt.transpose() * J_tilt;
    b -= tilt_information * J_tilt.transpose() * up.head<2>();

    const Eigen::LDLT<Matrix6d> ldlt(H);
    const Vector6d step = ldlt.solve(b);
    estimate.covariance = ldlt.solve(Matrix6d::Identity());
    if (!step.allFinite()) {
      break;
    }
    estimate.T_m_c = estimate.T_m_c.Plus(step);
    if (step.squaredNorm() < 1e-14) {
      break;
    }
  }
  return estimate;
}

}  // namespace pangea
