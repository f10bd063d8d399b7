#pragma once

// What the IMU says of two frames: a preintegrated motion, and biases that wander (Forster et al.,
// TRO 2017, with right-invariant errors; docs/maths_vio.md).

#include <Eigen/Core>

#include "common/imu.h"
#include "vio/window_state.h"

namespace pangea::vio {

// r = r(x^) + J_from e_from + J_to e_to, rows (rotation, velocity, position, gyro bias, accel
// bias); its information matrix is that of InertialInformation.
struct InertialResidual {
  Eigen::Matrix<double, 15, 1> r;
  Eigen::Matrix<double, 15, 15> J_from, J_to;
};
InertialResidual ComputeInertialResidual(const Preintegration& measured, const ImuState& from,
                                         const ImuState& to);

Eigen::Matrix<double, 15, 15> InertialInformation(const Preintegration& measured,
                                                  const ImuNoise& noise);

// Where the measured motion leads.
ImuState Predict(const Preintegration& measured, const ImuState& from);

}  // namespace pangea::vio
