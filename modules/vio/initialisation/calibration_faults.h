#pragma once

// Usual mistakes in a calibration, looked for when images and IMU do not fit: a sign, axes, or a
// focal length that is far off. A mistake is only named if the odometry would start without it.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/camera_model.h"
#include "core/imu/imu.h"
#include "vio/initialisation/initial_solution.h"

namespace pangea::vio {

// One mistake, and the values without it.
struct CalibrationFault {
  std::string text = {};  // for people: what is wrong, and the mend
  CameraModel camera = {};
  double gyro_sign = 1;  // -1: all three axes negated
  double accel_sign = 1;
};

// The same mistake, with about the same values.
bool AreSame(const CalibrationFault& a, const CalibrationFault& b);

// The frames of the start, as a camera sees them.
using FramesOf = std::function<std::vector<StartFrame>(const CameraModel&)>;
std::vector<StartFrame> WithoutFault(const FramesOf& frames_of, const CalibrationFault& fault);

// The mistake without which the gyro fits the images' rotations best; empty if none makes it
// clearly better. Rotations do not depend on the accelerometer.
std::optional<CalibrationFault> FaultByRotations(const FramesOf& frames_of,
                                                 const CameraModel& camera, const ImuNoise& noise);

CalibrationFault NegatedAccelerometer(const CameraModel& camera);

}  // namespace pangea::vio
