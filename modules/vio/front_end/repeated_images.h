#pragma once

// Recognises images that show nothing new under a new stamp: a browser or a screen recorder at
// 60 Hz repeats the image of a 20 Hz camera, and a camera that drops an image may repeat the last.
// Taken for a view, such a copy would measure that the body had not moved.
//
// A copy has the same pixels, apart from the noise of compression: no feature has moved. It is not
// mistaken for a body that stands still, because then neither the gyroscope nor the motion of the
// features up to here lets a shift be expected. No clock; deterministic.

#include <Eigen/Geometry>
#include <cstdint>
#include <opencv2/core/mat.hpp>

#include "core/camera_model.h"
#include "vio/front_end/tracks.h"

namespace pangea::vio {

class RepeatedImages {
 public:
  explicit RepeatedImages(const CameraModel& camera) : camera_(camera) {}

  // Whether the image repeats the last new one. `q_cam_lastcam`: rotation of the camera since then
  // (as for Tracker::Track), and `max_rotation_error` its largest error, radians.
  bool IsRepeat(int64_t utime, const cv::Mat& image, const Eigen::Quaterniond& q_cam_lastcam,
                double max_rotation_error) const;
  // Notes a new image and its features.
  void NoteNew(const cv::Mat& image, const TrackedFrame& frame);
  // Forgets the last image: the next one is new.
  void Reset() { *this = RepeatedImages(camera_); }

 private:
  double ExpectedShift_px(const Eigen::Quaterniond& q_cam_lastcam, double max_rotation_error,
                          double age_s) const;
  size_t PointStep() const;
  bool HasMovedLessThan(double shift_px, const cv::Mat& image) const;

  CameraModel camera_;
  cv::Mat image_;          // the last new one; empty: none
  TrackedFrame frame_;     // of it
  double speed_px_s_ = 0;  // of the features, median
};

}  // namespace pangea::vio
