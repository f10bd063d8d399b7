#pragma once

// Writes a result as sensor.yaml files of a recording (docs/recordings.md), with standard
// deviations beside the values.

#include <string>

#include "calibration/calibrate.h"

namespace pangea::calibration {

std::string CameraYaml(const Result& result, double rate_hz);
std::string ImuYaml(const Result& result, const ImuNoise& noise);

}  // namespace pangea::calibration
