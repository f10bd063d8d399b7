#pragma once

// What is known of the window when it starts: the initialiser's state, the given calibration, and
// what the IMU's may be off.

#include <Eigen/Core>

#include "core/calibration_sigmas.h"
#include "core/camera_model.h"
#include "vio/window/window_problem.h"

namespace pangea::vio {

// Whether nobody measured the lens to what a tenth of a pixel needs: then nobody measured the IMU.
bool IsRough(const CameraModel& camera, const CalibrationSigmas& given);

// A moving start: the first of its frames has an origin and a yaw, which are chosen; all else its
// frames will tell, but for biases of a plausible size. The accelerometer's is about zero.
WindowPrior MovingStartPrior(const WindowState& start, const CameraModel& camera,
                             const CalibrationSigmas& given, const ImuNoise& noise,
                             double accel_bias_sigma);

// `start` has one frame. `covariance`: of its (dtheta, dp, dv, gyro bias, accel bias), dtheta on
// the left, all differences plain (InitialState).
WindowPrior StartPrior(const WindowState& start, const Eigen::Matrix<double, 15, 15>& covariance,
                       const CameraModel& camera, const CalibrationSigmas& given,
                       const ImuNoise& noise);

}  // namespace pangea::vio
