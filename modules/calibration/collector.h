#pragma once

// Collects the input of a calibration image by image, from an uncalibrated camera. Of images and of
// samples, each kind in time order, either may be ahead of the other. An image or sample that is
// not later than the last one is ignored, and so is an implausible sample, and an image that
// repeats the last one (repeated_images.h).

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <optional>

#include "calibration/calibrate.h"
#include "vio/front_end/repeated_images.h"
#include "vio/front_end/tracker.h"

namespace pangea::calibration {

class Collector {
 public:
  // `width`, `height`: of the images, pixels. `q_body_cam`: if known, to some degrees.
  Collector(int width, int height, const ImuNoise& noise,
            const std::optional<Eigen::Quaterniond>& q_body_cam);

  void AddImu(const ImuSample& sample);
  // 8-bit grey.
  void AddImage(int64_t utime, const cv::Mat& image);
  // Forgets all images and samples before this time.
  void Forget(int64_t before_utime);

  const Input& input() const { return input_; }

 private:
  Input input_;
  vio::Tracker tracker_;
  vio::RepeatedImages repeated_images_;
};

}  // namespace pangea::calibration
