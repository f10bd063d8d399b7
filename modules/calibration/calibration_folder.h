#pragma once

// A recording's folder beside the original: links to its images, samples and ground truth, and
// sensor.yaml files of its own. So what is calibrated can be played as it is.

#include <string>

#include "calibration/calibrate.h"

namespace pangea::calibration {

// It is made as `out`.part, so that nobody takes one without a calibration for one with.
class CalibrationFolder {
 public:
  // Links, and sensor.yaml files that know the image's size only. What the recording's own files
  // say of noise is kept, where there are any; of the camera nothing is. Throws std::runtime_error,
  // also when `out` or its part exists.
  CalibrationFolder(const std::string& recording, const std::string& out);
  // Removes what was not finished.
  ~CalibrationFolder();
  CalibrationFolder(const CalibrationFolder&) = delete;
  CalibrationFolder& operator=(const CalibrationFolder&) = delete;

  // The recording to calibrate on.
  const std::string& part() const { return part_; }
  // A message about files of the part, for people: about the recording's own.
  std::string AboutTheRecording(std::string text) const;
  // The calibration, and its summary as calibration.txt.
  void Finish(const Result& result, const ImuNoise& noise, const std::string& summary);

 private:
  void Remove();

  std::string recording_mav0_, out_, part_;
  bool finished_ = false;
};

}  // namespace pangea::calibration
