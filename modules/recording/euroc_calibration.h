#pragma once

// Reads EuRoC's sensor.yaml files, or Kalibr's camchain and IMU files in their place (of these only
// cam0 and imu0 are used).

#include <optional>
#include <string>
#include <vector>

#include "core/calibration_sigmas.h"
#include "core/camera_model.h"
#include "core/imu/imu.h"

namespace pangea {

struct EurocImuCalibration {
  ImuNoise noise;
  Rigid3 T_s_body;  // T_BS of the IMU: from the IMU (body) to EuRoC's rig frame s
};

// Path of the calibration of "cam0" or "imu0": sensor.yaml or, as in TUM-VI, in dso/ beside mav0.
// Nothing when there is neither.
std::optional<std::string> FindEurocCalibrationFile(const std::string& mav0,
                                                    const std::string& sensor);
// The same, but throws std::runtime_error when there is neither.
std::string EurocCalibrationFile(const std::string& mav0, const std::string& sensor);
// Note: T_body_cam of the result is the file's T_BS, from the camera to the rig frame.
// All functions throw std::runtime_error with file and field. `warnings`, if given, gets what was
// repaired: a rotation of a few digits.
CameraModel ReadEurocCamera(const std::string& sensor_yaml,
                            std::vector<std::string>* warnings = nullptr);
// Nothing when the file has none of the keys (docs/recordings.md); a missing key gives the default.
std::optional<CalibrationSigmas> ReadEurocCalibrationSigmas(const std::string& sensor_yaml);
EurocImuCalibration ReadEurocImuCalibration(const std::string& sensor_yaml,
                                            std::vector<std::string>* warnings = nullptr);
// The same for a text; `sensor_yaml` is its name in error messages.
CameraModel ParseEurocCamera(const std::string& text, const std::string& sensor_yaml,
                             std::vector<std::string>* warnings = nullptr);
std::optional<CalibrationSigmas> ParseEurocCalibrationSigmas(const std::string& text,
                                                             const std::string& sensor_yaml);
EurocImuCalibration ParseEurocImuCalibration(const std::string& text,
                                             const std::string& sensor_yaml,
                                             std::vector<std::string>* warnings = nullptr);
// T_BS of any sensor; the identity when the file or the key is missing.
Rigid3 ReadEurocExtrinsics(const std::string& sensor_yaml,
                           std::vector<std::string>* warnings = nullptr);

}  // namespace pangea
