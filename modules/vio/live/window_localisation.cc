#include "vio/live/window_localisation.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "vio/live/map_landmark_factor.h"

namespace pangea::vio {
namespace {

using Eigen::Matrix3d;
using Eigen::Matrix4d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr int kPose = 6;    // (dtheta, xi), right-invariant: see window_state.h
constexpr int kSource = 4;  // (shift, yaw)
constexpr int kRobustIterations = 4;
constexpr int kFinalIterations = 3;
// Minimum variance (0.01 mm, 0.01 mrad): keeps the covariance invertible for a stationary body.
constexpr double kFloor = 1e-10;

// Maps an error to another frame, T = T_new_old: dtheta' = R dtheta, xi' = R xi + t x R dtheta.
MatrixXd Adjoint(const Rigid3& T) {
  MatrixXd A = MatrixXd::Zero(kPose, kPose);
  A.block<3, 3>(0, 0) = A.block<3, 3>(3, 3) = T.R();
  A.block<3, 3>(3, 0) = Hat(T.t) * T.R();
  return A;
}

// Jacobian of the error (dtheta, xi) of a pose at p with respect to its shift and yaw.
Eigen::Matrix<double, kPose, 4> ShiftAndYaw(const Vector3d& p) {
  Eigen::Matrix<double, kPose, 4> N = Eigen::Matrix<double, kPose, 4>::Zero();
  N(2, 3) = 1;
  N.block<3, 3>(3, 0).setIdentity();
  N.block<3, 1>(3, 3) = Hat(p) * Vector3d::UnitZ();
  return N;
}

class Problem {
 public:
  Problem(const WindowPoses& window, const Rigid3& T_body_cam, const LocalizationPrior& prior,
          const std::vector<Vector3d>& source_positions, const std::vector<SeenLandmark>& landmarks,
          const LocalizationOptions& options)
      : options_(options),
        T_body_cam_(T_body_cam),
        landmarks_(landmarks),
        sources_(source_positions),
        // All coordinates are relative to the newest pose: no long levers.
        origin_((prior.T_map_odom * window.T_odom_body.back()).t),
        T_local_odom_(prior.T_map_odom.q, prior.T_map_odom.t - origin_),
        fits_(landmarks.size(), true) {
    for (const Rigid3& T_odom_body : window.T_odom_body) {
      poses_.push_back(T_local_odom_ * T_odom_body);
    }
    start_ = poses_;
    const int num_window = kPose * static_cast<int>(poses_.size());
    const int n = num_window + kSource * static_cast<int>(sources_.size());
    x_ = VectorXd::Zero(n);
    information_ = MatrixXd::Zero(n, n);
    information_.topLeftCorner(num_window, num_window) =
        WindowCovarianceInMap(window, prior)
            .ldlt()
            .solve(MatrixXd::Identity(num_window, num_window));
    const double position = 1 / std::pow(options.source_position_sigma, 2);
    const double yaw = 1 / std::pow(options.source_yaw_sigma, 2);
    for (int at = num_window; at < n; at += kSource) {
      information_.diagonal().segment<kSource>(at) << position, position, position, yaw;
    }
  }

  std::optional<LocalizationResult> Solve(const WindowPoses& window,
                                          const LocalizationPrior& prior) {
    for (int i = 0; i < kRobustIterations; ++i) {
      Iterate(true);
    }
    for (size_t l = 0; l < landmarks_.size(); ++l) {
      fits_[l] = Chi2(l) <= options_.max_landmark_chi2;
    }
    for (int i = 0; i < kFinalIterations; ++i) {
      Iterate(false);
    }
    LocalizationResult result;
    result.fits = fits_;
    result.num_fitting = static_cast<int>(std::count(fits_.begin(), fits_.end(), true));
    const Eigen::Vector4d moved = ShiftAndYawOf(x_.head<kPose>(), start_.front().t);
    result.prior_chi2 = moved.dot(prior.covariance.ldlt().solve(moved));
    if (result.num_fitting < options_.min_landmarks || !x_.allFinite() ||
        !(result.prior_chi2 <= options_.max_prior_chi2)) {
      return std::nullopt;
    }
    const int newest = kPose * (static_cast<int>(poses_.size()) - 1);
    const Rigid3& T_local_body = poses_.back();
    const Eigen::Quaterniond q_map_odom =
        (YawRotation(x_[newest + 2]) * prior.T_map_odom.q).normalized();
    result.T_map_odom = {q_map_odom,
                         T_local_body.t + origin_ - q_map_odom * window.T_odom_body.back().t};
    const MatrixXd covariance =
        system_.ldlt().solve(MatrixXd::Identity(system_.rows(), system_.cols()));
    Eigen::Matrix<double, 4, kPose> J = Eigen::Matrix<double, 4, kPose>::Zero();
    J.block<3, 3>(0, 3).setIdentity();
    J.block<3, 3>(0, 0) = -Hat(T_local_body.t);
    J(3, 2) = 1;
    result.covariance = J * covariance.block<kPose, kPose>(newest, newest) * J.transpose();
    return result;
  }

 private:
  static Eigen::Vector4d ShiftAndYawOf(const VectorXd& error, const Vector3d& p) {
    Eigen::Vector4d out;
    out << error.segment<3>(3) - p.cross(Vector3d(error.head<3>())), error[2];
    return out;
  }

  MatrixXd WindowCovarianceInMap(const WindowPoses& window, const LocalizationPrior& prior) const {
    const int n = kPose * static_cast<int>(poses_.size());
    MatrixXd relative = MatrixXd::Identity(n, n);
    const MatrixXd adjoint = Adjoint(T_local_odom_);
    const MatrixXd N = ShiftAndYaw(poses_.front().t);
    MatrixXd common(n, 4);
    for (int at = 0; at < n; at += kPose) {
      // Remove position and yaw of the first pose: the rest is relative to it.
      relative.block<4, 4>(at + 2, 2) -= Matrix4d::Identity();
      common.middleRows<kPose>(at) = N;
    }
    MatrixXd rotated(n, n);
    for (int i = 0; i < n; i += kPose) {
      for (int j = 0; j < n; j += kPose) {
        rotated.block<kPose, kPose>(i, j) =
            adjoint * window.covariance.block<kPose, kPose>(i, j) * adjoint.transpose();
      }
    }
    MatrixXd covariance = relative * rotated * relative.transpose();
    covariance += common * prior.covariance * common.transpose();
    covariance.diagonal().array() += kFloor;
    return 0.5 * (covariance + covariance.transpose());
  }

  int SourceAt(size_t landmark) const {
    return kPose * static_cast<int>(poses_.size()) + kSource * landmarks_[landmark].source;
  }

  Whitened Residual(size_t l) const {
    const SeenLandmark& landmark = landmarks_[l];
    const Vector3d c = sources_[landmark.source] - origin_;
    const Eigen::Vector4d s = x_.segment<kSource>(SourceAt(l));
    return WhitenLandmark(poses_, T_body_cam_, landmark, origin_, c, s);
  }

  // Chi-squared per degree of freedom; infinite if the landmark is behind a camera.
  double Chi2(size_t l) const {
    const Whitened w = Residual(l);
    return w.r.size() > 0 ? w.r.squaredNorm() / static_cast<double>(w.r.size())
                          : std::numeric_limits<double>::infinity();
  }

  void AddLandmark(size_t l, const Whitened& w, double weight, VectorXd* g) {
    const int at_source = SourceAt(l);
    const auto& rays = landmarks_[l].rays;
    const MatrixXd weighted = weight * w.J_pose.transpose();
    const MatrixXd cross = weighted * w.J_source;
    const MatrixXd square = weighted * w.J_pose;
    const VectorXd gradient = weighted * w.r;
    for (int i = 0; i < static_cast<int>(rays.size()); ++i) {
      const int at_i = kPose * rays[i].pose, from_i = kPose * i;
      g->segment<kPose>(at_i) += gradient.segment<kPose>(from_i);
      system_.block<kPose, kSource>(at_i, at_source) += cross.middleRows<kPose>(from_i);
      system_.block<kSource, kPose>(at_source, at_i) += cross.middleRows<kPose>(from_i).transpose();
      for (int j = 0; j < static_cast<int>(rays.size()); ++j) {
        system_.block<kPose, kPose>(at_i, kPose * rays[j].pose) +=
            square.block<kPose, kPose>(from_i, kPose * j);
      }
    }
    g->segment<kSource>(at_source) += weight * w.J_source.transpose() * w.r;
    system_.block<kSource, kSource>(at_source, at_source) +=
        weight * w.J_source.transpose() * w.J_source;
  }

  void Iterate(bool robust) {
    system_ = information_;
    VectorXd g = information_ * x_;
    for (size_t l = 0; l < landmarks_.size(); ++l) {
      const Whitened w = fits_[l] ? Residual(l) : Whitened{};
      if (w.r.size() > 0) {
        // Cauchy weight of the whole landmark.
        const double chi2 = w.r.squaredNorm() / static_cast<double>(w.r.size());
        AddLandmark(l, w, robust ? 1 / (1 + chi2) : 1, &g);
      }
    }
    x_ -= system_.ldlt().solve(g);
    for (size_t i = 0; i < poses_.size(); ++i) {
      const auto e = x_.segment<kPose>(kPose * static_cast<int>(i));
      const Eigen::Quaterniond rotation = ExpSo3(e.head<3>());
      poses_[i] = {(rotation * start_[i].q).normalized(), rotation * start_[i].t + e.tail<3>()};
    }
  }

  LocalizationOptions options_;
  Rigid3 T_body_cam_;
  const std::vector<SeenLandmark>& landmarks_;
  const std::vector<Vector3d>& sources_;
  Vector3d origin_;
  Rigid3 T_local_odom_;
  std::vector<Rigid3> start_, poses_;  // T_local_body
  std::vector<bool> fits_;
  VectorXd x_;
  MatrixXd information_, system_;
};

}  // namespace

std::optional<LocalizationResult> LocalizeWindow(const WindowPoses& window,
                                                 const Rigid3& T_body_cam,
                                                 const LocalizationPrior& prior,
                                                 const std::vector<Vector3d>& source_positions,
                                                 const std::vector<SeenLandmark>& landmarks,
                                                 const LocalizationOptions& options) {
  if (static_cast<int>(landmarks.size()) < options.min_landmarks) {
    return std::nullopt;
  }
  return Problem(window, T_body_cam, prior, source_positions, landmarks, options)
      .Solve(window, prior);
}

}  // namespace pangea::vio
