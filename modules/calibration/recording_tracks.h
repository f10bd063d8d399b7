#pragma once

// What is calibrated on, from a recording: its images' tracks and its inertial samples.

#include "calibration/calibrate.h"
#include "recording/euroc.h"

namespace pangea::calibration {

struct PartOfRecording {
  double start_s = 0, duration_s = 60;
};

// The tracker knows the image's size and a field of view only, and no rotation.
Input TracksOf(const EurocRecording& recording, const PartOfRecording& part);

}  // namespace pangea::calibration
