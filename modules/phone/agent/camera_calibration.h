#pragma once

// A phone's camera calibrated while somebody moves it: what the page shows, and what comes of it.
// One thread, no clock; as PhoneAgent.

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>

#include "calibration/collector.h"

namespace pangea::phone {

struct CalibrationProgress {
  double share = 0;  // of what suffices, 0 to 1
  // What is missing most: "rotation about x", "... y", "... z" (camera's axes, or the body's where
  // the camera's are not known), "points", "time"; "" when nothing is.
  std::string missing;
};

class CameraCalibration {
 public:
  // Older images count no more: a camera that was held still must not be carried along for ever.
  static constexpr int64_t kWindow_us = 60'000'000;

  // `imu_yaml`: of mav0/imu0/sensor.yaml; throws std::runtime_error naming the field.
  CameraCalibration(int width, int height, const std::string& imu_yaml,
                    const std::optional<Eigen::Quaterniond>& q_body_cam);

  void AddImu(const ImuSample& sample) { collector_.AddImu(sample); }
  // 8-bit grey, of that size.
  void AddImage(int64_t utime, const cv::Mat& image);

  CalibrationProgress progress() const;
  // The text of mav0/cam0/sensor.yaml, with standard deviations; or why it is refused. Seconds of
  // CPU.
  struct Outcome {
    std::string camera_yaml;
    std::string refused;  // empty: it holds
  };
  Outcome Solve() const;

 private:
  calibration::Collector collector_;
};

}  // namespace pangea::phone
