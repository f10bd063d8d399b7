#pragma once

// The first prior of the window: the initialiser's state, the given calibration, and the
// uncertainty of the IMU's intrinsics.

#include <Eigen/Core>

#include "core/calibration_sigmas.h"
#include "core/camera_model.h"
#include "vio/window/window_problem.h"

namespace pangea::vio {

// Whether the calibration is rough: the distortion's sigma is above 0.001, about a tenth of a
// pixel. The IMU is then taken to be uncalibrated too.
bool IsRough(const CameraModel& camera, const CalibrationSigmas& given);

// Prior of a moving start. Origin and yaw of the first frame are chosen, so they are known; the
// biases have weak priors, that of the accelerometer about zero; everything else follows from the
// frames.
WindowPrior MovingStartPrior(const WindowState& start, const CameraModel& camera,
                             const CalibrationSigmas& given, const ImuNoise& noise,
                             double accel_bias_sigma);

// Prior of a stationary start; `start` has one frame. `covariance`: of its (dtheta, dp, dv, gyro
// bias, accel bias), dtheta on the left, all others plain differences (InitialState).
WindowPrior StartPrior(const WindowState& start, const Eigen::Matrix<double, 15, 15>& covariance,
                       const CameraModel& camera, const CalibrationSigmas& given,
                       const ImuNoise& noise);

}  // namespace pangea::vio
