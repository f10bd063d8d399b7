#pragma once

// A new recording folder with links to the original's images, samples and ground truth, and its own
// sensor.yaml files, so that the calibrated recording can be played directly.

#include <string>

#include "calibration/calibrate.h"

namespace pangea::calibration {

// The folder is named `out`.part until it is finished, so that nobody uses it without a
// calibration.
class CalibrationFolder {
 public:
  // Makes the links, and sensor.yaml files with only the image size. The noise in the recording's
  // own files is kept, if there are any; their camera is not. Throws std::runtime_error, also if
  // `out` or `out`.part exists.
  CalibrationFolder(const std::string& recording, const std::string& out);
  // Removes the folder if it is not finished.
  ~CalibrationFolder();
  CalibrationFolder(const CalibrationFolder&) = delete;
  CalibrationFolder& operator=(const CalibrationFolder&) = delete;

  // The folder with the recording to calibrate.
  const std::string& part() const { return part_; }
  // Replaces paths in the part by paths in the original recording, in a message for people.
  std::string AboutTheRecording(std::string text) const;
  // Writes the calibration, and its summary as calibration.txt, and gives the folder its name.
  void Finish(const Result& result, const ImuNoise& noise, const std::string& summary);

 private:
  void WriteSensorYaml(const Result& result, const ImuNoise& noise) const;
  void Remove();

  std::string recording_mav0_, out_, part_;
  Rigid3 T_s_body_;  // the recording's: its ground truth refers to the rig
  bool finished_ = false;
};

}  // namespace pangea::calibration
