#pragma once

// Makes the input of a calibration from a recording: tracks of its images, and its samples.

#include <optional>

#include "calibration/calibrate.h"
#include "recording/euroc.h"

namespace pangea::calibration {

struct PartOfRecording {
  double start_s = 0, duration_s = 60;
};

// `q_body_cam`: see Input.
Input TracksOf(const EurocRecording& recording, const PartOfRecording& part,
               const std::optional<Eigen::Quaterniond>& q_body_cam);

}  // namespace pangea::calibration
