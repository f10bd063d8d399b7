#pragma once

// What is calibrated on, from a recording: its images' tracks and its inertial samples.

#include <optional>

#include "calibration/calibrate.h"
#include "recording/euroc.h"

namespace pangea::calibration {

struct PartOfRecording {
  double start_s = 0, duration_s = 60;
};

// `q_body_cam` as of Input.
Input TracksOf(const EurocRecording& recording, const PartOfRecording& part,
               const std::optional<Eigen::Quaterniond>& q_body_cam);

}  // namespace pangea::calibration
