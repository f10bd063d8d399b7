#include "eval/trajectory_alignment.h"

#include <Eigen/SVD>
#include <cmath>

namespace pangea {
namespace {

Eigen::Vector3d Mean(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) {
    sum += p;
  }
  return sum / static_cast<double>(points.size());
}

}  // namespace

std::string ToString(TrajectoryAlignmentKind kind) {
  switch (kind) {
    case TrajectoryAlignmentKind::kSe3:
      return "SE(3)";
    case TrajectoryAlignmentKind::kYaw:
      return "yaw";
    case TrajectoryAlignmentKind::kSim3:
      return "Sim(3)";
  }
  return "";
}

TrajectoryAlignment AlignTrajectories(const std::vector<Eigen::Vector3d>& estimate,
                                      const std::vector<Eigen::Vector3d>& reference,
                                      TrajectoryAlignmentKind kind) {
  const Eigen::Vector3d mean_estimate = Mean(estimate);
  const Eigen::Vector3d mean_reference = Mean(reference);
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  // Umeyama's Sigma_xy times n
  double variance = 0;                                   // sigma_x^2 times n
  for (size_t i = 0; i < estimate.size(); ++i) {
    const Eigen::Vector3d x = estimate[i] - mean_estimate;
    covariance += (reference[i] - mean_reference) * x.transpose();
    variance += x.squaredNorm();
  }
  TrajectoryAlignment alignment;
  Rigid3& T = alignment.T_reference_estimate;
  if (kind == TrajectoryAlignmentKind::kYaw) {
    // tr(Rz(yaw)' covariance) is largest here.
    T.q = YawRotation(
        std::atan2(covariance(1, 0) - covariance(0, 1), covariance(0, 0) + covariance(1, 1)));
  } else {
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance,
                                                Eigen::ComputeFullU | Eigen::ComputeFullV);
    Eigen::Vector3d s(1, 1, 1);  // no reflection: Umeyama eq. 39
    if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0) {
      s.z() = -1;
    }
    T.q = Eigen::Quaterniond(
              Eigen::Matrix3d(svd.matrixU() * s.asDiagonal() * svd.matrixV().transpose()))
              .normalized();
    if (kind == TrajectoryAlignmentKind::kSim3 && variance > 0) {
      alignment.scale = svd.singularValues().dot(s) / variance;  // eq. 42
    }
  }
  T.t = mean_reference - T.q * (alignment.scale * mean_estimate);
  return alignment;
}

}  // namespace pangea
