#pragma once

// Calibrates a phone's camera while somebody moves the phone: the progress for the page, and the
// result. No clock; not thread safe; used as PhoneAgent is.

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>

#include "calibration/collector.h"

namespace pangea::phone {

struct CalibrationProgress {
  double share = 0;  // share of the motion that suffices, 0 to 1
  // What is missing most: "rotation about x", "... y", "... z" (the camera's axes, or the body's if
  // the camera's are not known), "points", "time"; "" if nothing is.
  std::string missing;
};

class CameraCalibration {
 public:
  // Older images are dropped, because images of a camera that was held still must not stay for
  // ever.
  static constexpr int64_t kWindow_us = 60'000'000;

  // `imu_yaml`: text of a mav0/imu0/sensor.yaml. Throws std::runtime_error with the field.
  CameraCalibration(int width, int height, const std::string& imu_yaml,
                    const std::optional<Eigen::Quaterniond>& q_body_cam);

  void AddImu(const ImuSample& sample) { collector_.AddImu(sample); }
  // `image`: 8-bit grey, of the size given to the constructor.
  void AddImage(int64_t utime, const cv::Mat& image);

  CalibrationProgress progress() const;
  // Returns the text of a mav0/cam0/sensor.yaml with standard deviations, or why there is none.
  // Takes seconds of CPU time.
  struct Outcome {
    std::string camera_yaml;
    std::string refused;  // empty: the calibration is good
  };
  Outcome Solve() const;

 private:
  calibration::Collector collector_;
};

}  // namespace pangea::phone
