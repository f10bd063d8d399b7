#pragma once

// The IMU factor between two frames: preintegrated motion and random walk of the biases (Forster et
// al., TRO 2017, with right-invariant errors; docs/maths_vio.md).
//
// Errors are right-invariant: the rotation error dtheta is on the LEFT (R = Exp(dtheta) R^), and it
// also rotates every vector in the odom frame (p = Exp(dtheta) p^ + xi; velocity alike).

#include <Eigen/Core>

#include "core/imu/imu.h"
#include "core/imu/preintegration.h"
#include "core/rigid3.h"

namespace pangea {

// First index of each part in the error vector of one frame.
inline constexpr int kTheta = 0, kPosition = 3, kVelocity = 6, kGyroBias = 9, kAccelBias = 12;
inline constexpr int kFrameSize = 15;

struct ImuState {
  Rigid3 T_odom_body;
  Eigen::Vector3d v_odom_body = Eigen::Vector3d::Zero();  // m/s
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();    // rad/s
  Eigen::Vector3d accel_bias = Eigen::Vector3d::Zero();   // m/s^2
};

// First-order residual r(x^) + J_from e_from + J_to e_to, e being the errors of the two frames.
// Rows: (rotation, velocity, position, gyro bias, accel bias). InertialInformation gives its
// information matrix.
struct InertialResidual {
  Eigen::Matrix<double, 15, 1> r;
  Eigen::Matrix<double, 15, 15> J_from, J_to;
};
InertialResidual ComputeInertialResidual(const Preintegration& measured, const ImuState& from,
                                         const ImuState& to);

// `unmodelled_accel_sigma`: standard deviation, m/s^2, of an acceleration error that is constant
// between the two frames.
Eigen::Matrix<double, 15, 15> InertialInformation(const Preintegration& measured,
                                                  const ImuNoise& noise,
                                                  double unmodelled_accel_sigma = 0);

// The state that follows from `from` by the measured motion.
ImuState Predict(const Preintegration& measured, const ImuState& from);

}  // namespace pangea
