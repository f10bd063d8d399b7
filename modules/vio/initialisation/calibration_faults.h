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

// Sums up, over the first windows after the start, how well each focal length fits the gyro's
// rotations. A single window tells less: rotation and translation look alike in it.
class FocalLengthCheck {
 public:
  FocalLengthCheck(const CameraModel& camera, const ImuNoise& noise);
  void Add(const FramesOf& frames_of);
  bool is_complete() const { return windows_ == kWindows; }
  // Once it is complete, a focal length that fits clearly better than the given one.
  std::optional<CalibrationFault> Found() const;

 private:
  static constexpr int kWindows = 4;

  CameraModel camera_;
  ImuNoise noise_;
  std::vector<double> costs_;  // of each focal length, the given one first; summed over the windows
  int windows_ = 0;
};

CalibrationFault NegatedAccelerometer(const CameraModel& camera);

}  // namespace pangea::vio
