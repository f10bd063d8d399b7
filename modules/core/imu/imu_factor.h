#pragma once

// What the IMU says of two frames: a preintegrated motion, and biases that wander (Forster et al.,
// TRO 2017, with right-invariant errors; docs/maths_vio.md).
//
// Errors are right-invariant: a rotation error dtheta is on the LEFT (R = Exp(dtheta) R^) and every
// vector that lives in odom is carried along by it (p = Exp(dtheta) p^ + xi).

#include <Eigen/Core>

#include "core/imu/imu.h"
#include "core/imu/preintegration.h"
#include "core/rigid3.h"

namespace pangea {

// Layout of one frame's error.
inline constexpr int kTheta = 0, kPosition = 3, kVelocity = 6, kGyroBias = 9, kAccelBias = 12;
inline constexpr int kFrameSize = 15;

struct ImuState {
  Rigid3 T_odom_body;
  Eigen::Vector3d v_odom_body = Eigen::Vector3d::Zero();  // m/s
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();    // rad/s
  Eigen::Vector3d accel_bias = Eigen::Vector3d::Zero();   // m/s^2
};

// r = r(x^) + J_from e_from + J_to e_to, rows (rotation, velocity, position, gyro bias, accel
// bias); its information matrix is that of InertialInformation.
struct InertialResidual {
  Eigen::Matrix<double, 15, 1> r;
  Eigen::Matrix<double, 15, 15> J_from, J_to;
};
InertialResidual ComputeInertialResidual(const Preintegration& measured, const ImuState& from,
                                         const ImuState& to);

// `unmodelled_accel_sigma`: m/s^2, of an acceleration that only the IMU feels, constant in the
// span.
Eigen::Matrix<double, 15, 15> InertialInformation(const Preintegration& measured,
                                                  const ImuNoise& noise,
                                                  double unmodelled_accel_sigma = 0);

// Where the measured motion leads.
ImuState Predict(const Preintegration& measured, const ImuState& from);

}  // namespace pangea
