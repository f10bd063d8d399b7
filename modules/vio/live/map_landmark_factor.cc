#include "vio/live/map_landmark_factor.h"

#include <Eigen/Cholesky>

namespace pangea::vio {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;

namespace {

constexpr double kMinDepth = 0.1;  // m

}  // namespace

Whitened WhitenLandmark(const std::vector<Rigid3>& poses, const Rigid3& T_body_cam,
                        const SeenLandmark& landmark, const Vector3d& origin,
                        const Vector3d& p_source, const Eigen::Vector4d& source) {
  const int num_rays = static_cast<int>(landmark.rays.size());
  const Matrix3d R_yaw = YawRotation(source[3]).toRotationMatrix();
  const Vector3d arm = R_yaw * (landmark.p_map - origin - p_source);
  const Vector3d p = p_source + arm + source.head<3>();
  Whitened out;
  Eigen::VectorXd r(2 * num_rays);
  MatrixXd J_pose = MatrixXd::Zero(2 * num_rays, 6 * num_rays);
  MatrixXd J_point(2 * num_rays, 3);
  MatrixXd S = MatrixXd::Zero(2 * num_rays, 2 * num_rays);
  for (int i = 0; i < num_rays; ++i) {
    const SeenLandmark::Ray& seen = landmark.rays[i];
    const Rigid3 T_cam_map = (poses[seen.pose] * T_body_cam).Inverse();
    const Vector3d y = T_cam_map * p;
    if (!(y.z() > kMinDepth)) {
      return out;
    }
    const double inverse = 1 / y.z();
    Eigen::Matrix<double, 2, 3> J;
    J << inverse, 0, -y.x() * inverse * inverse, 0, inverse, -y.y() * inverse * inverse;
    const Eigen::Matrix<double, 2, 3> J_p = J * T_cam_map.R();
    r.segment<2>(2 * i) = y.head<2>() * inverse - seen.ray;
    // A pose moved by (dtheta, xi) sees the point as if it had moved by -(xi + dtheta x p).
    J_pose.block<2, 3>(2 * i, 6 * i) = J_p * Hat(p);
    J_pose.block<2, 3>(2 * i, 6 * i + 3) = -J_p;
    J_point.middleRows<2>(2 * i) = J_p;
    S.diagonal().segment<2>(2 * i).setConstant(seen.sigma * seen.sigma);
  }
  S += J_point * (R_yaw * landmark.covariance * R_yaw.transpose()) * J_point.transpose();
  const Eigen::LLT<MatrixXd> llt(S);
  out.r = llt.matrixL().solve(r);
  out.J_pose = llt.matrixL().solve(J_pose);
  Eigen::Matrix<double, 3, 4> J_shift;
  J_shift << Matrix3d::Identity(), Vector3d::UnitZ().cross(arm);
  out.J_source = llt.matrixL().solve(J_point * J_shift);
  return out;
}

}  // namespace pangea::vio
