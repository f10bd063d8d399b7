#pragma once

// A result as the sensor.yaml files of a recording (docs/recordings.md), standard deviations beside
// the values.

#include <string>

#include "calibration/calibrate.h"

namespace pangea::calibration {

std::string CameraYaml(const Result& result, double rate_hz);
std::string ImuYaml(const Result& result, const ImuNoise& noise);

}  // namespace pangea::calibration
