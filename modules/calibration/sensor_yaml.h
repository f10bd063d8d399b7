#pragma once

// Writes a result as sensor.yaml files of a recording (docs/recordings.md), with standard
// deviations beside the values.

#include <string>

#include "calibration/calibrate.h"

namespace pangea::calibration {

// `T_s_body`: pose of the IMU in the frame of the recording's rig, which its ground truth refers
// to.
std::string CameraYaml(const Result& result, double rate_hz, const Rigid3& T_s_body = {});
std::string ImuYaml(const Result& result, const ImuNoise& noise, const Rigid3& T_s_body = {});

}  // namespace pangea::calibration
