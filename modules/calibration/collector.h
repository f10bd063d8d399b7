#pragma once

// What is calibrated on, gathered image by image from a camera that is not known yet. Images and
// samples each in the order of their times; either may run ahead.

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <optional>

#include "calibration/calibrate.h"
#include "vio/front_end/tracker.h"

namespace pangea::calibration {

class Collector {
 public:
  // Of the image's size, in pixels. `q_body_cam` to some degrees, where it is known.
  Collector(int width, int height, const ImuNoise& noise,
            const std::optional<Eigen::Quaterniond>& q_body_cam);

  void AddImu(const ImuSample& sample) { input_.imu.push_back(sample); }
  // 8-bit grey.
  void AddImage(int64_t utime, const cv::Mat& image);
  // Forgets what was before.
  void Forget(int64_t before_utime);

  const Input& input() const { return input_; }

 private:
  Input input_;
  vio::Tracker tracker_;
};

}  // namespace pangea::calibration
