#pragma once

// EuRoC's sensor.yaml files, or Kalibr's camchain and IMU files in their place (of which cam0 and
// imu0 count).

#include <optional>
#include <string>

#include "core/calibration_sigmas.h"
#include "core/camera_model.h"
#include "core/imu/imu.h"

namespace pangea {

struct EurocImuCalibration {
  ImuNoise noise;
  Rigid3 T_s_body;  // EuRoC's T_BS of the IMU: rig frame from IMU
};

// Where the calibration of "cam0" or "imu0" is: sensor.yaml, or as TUM-VI has it, beside mav0 in
// dso/. Throws std::runtime_error when there is neither.
std::string EurocCalibrationFile(const std::string& mav0, const std::string& sensor);
// T_body_cam of the result is the file's T_BS: rig frame from camera.
// All throw std::runtime_error naming file and field.
CameraModel ReadEurocCamera(const std::string& sensor_yaml);
// Nothing when the file says none of them (docs/recordings.md); those it does not say are as usual.
std::optional<CalibrationSigmas> ReadEurocCalibrationSigmas(const std::string& sensor_yaml);
EurocImuCalibration ReadEurocImuCalibration(const std::string& sensor_yaml);
// The same of a text at hand; `sensor_yaml` stands for it in messages.
CameraModel ParseEurocCamera(const std::string& text, const std::string& sensor_yaml);
std::optional<CalibrationSigmas> ParseEurocCalibrationSigmas(const std::string& text,
                                                             const std::string& sensor_yaml);
EurocImuCalibration ParseEurocImuCalibration(const std::string& text,
                                             const std::string& sensor_yaml);
// T_BS of any sensor; identity when the file or the key is missing.
Rigid3 ReadEurocExtrinsics(const std::string& sensor_yaml);

}  // namespace pangea
