#pragma once

// A recording's folder beside the original: links to its images, samples and ground truth, and
// sensor.yaml files of its own. So what is calibrated can be played as it is.

#include <string>

#include "calibration/calibrate.h"

namespace pangea::calibration {

// Creates out/mav0 with links, and sensor.yaml files that know the image's size only. What the
// recording's own files say of noise is kept, where there are any; of the camera nothing is.
// Throws std::runtime_error, also when `out` exists.
void MakeFolder(const std::string& recording, const std::string& out);

// Writes both sensor.yaml files anew.
void WriteSensorYaml(const std::string& out, const Result& result, const ImuNoise& noise);

}  // namespace pangea::calibration
