#pragma once

// Usual mistakes in a calibration, looked for when images and IMU do not fit: a sign, axes, or a
// focal length that is far off. A mistake is only named if the odometry would start without it.

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/camera_model.h"
#include "core/imu/imu.h"
#include "core/rigid3.h"
#include "vio/initialisation/initial_solution.h"

namespace pangea::vio {

// One mistake, and the values without it.
struct CalibrationFault {
  std::string text = {};  // for people: what is wrong, and the mend
  Rigid3 T_body_cam = {};
  double focal_factor = 1;  // the right focal length divided by the given one
  double gyro_sign = 1;     // -1: all three axes negated
  double accel_sign = 1;
};

// The frames as they would be without the mistake.
std::vector<StartFrame> WithoutFault(std::span<const StartFrame> frames,
                                     const CalibrationFault& fault);

// The mistake without which the gyro fits the images' rotations best; empty if none makes it
// clearly better. Rotations do not depend on the accelerometer.
std::optional<CalibrationFault> FaultByRotations(std::span<const StartFrame> frames,
                                                 const CameraModel& camera, const ImuNoise& noise);

CalibrationFault NegatedAccelerometer(const CameraModel& camera);

}  // namespace pangea::vio
