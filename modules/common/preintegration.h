#pragma once

// IMU preintegration between two frames, on the manifold (Forster et al., TRO 2017, section VI).

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace pangea {

// In the body frame of the first of the two frames, gravity not included. Error-state order of
// covariance and Jacobian rows: (rotation, velocity, position), rotation perturbed on the right;
// columns of the Jacobian: (gyro bias, accel bias).
struct Preintegration {
  double duration_s = 0;
  Eigen::Quaterniond delta_q = Eigen::Quaterniond::Identity();
  Eigen::Vector3d delta_v = Eigen::Vector3d::Zero();  // m/s
  Eigen::Vector3d delta_p = Eigen::Vector3d::Zero();  // m
  Eigen::Matrix<double, 9, 9> covariance = Eigen::Matrix<double, 9, 9>::Zero();
  Eigen::Matrix<double, 9, 6> bias_jacobian = Eigen::Matrix<double, 9, 6>::Zero();
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();   // rad/s, linearisation point
  Eigen::Vector3d accel_bias = Eigen::Vector3d::Zero();  // m/s^2
};

}  // namespace pangea
