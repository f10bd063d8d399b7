#pragma once

// Which stamp belongs to an image that was repeated: its first one, if whoever repeats images shows
// the last one until another comes; or its last one, if images are shown ahead of their time.
//
// The gyroscope decides. From one new image to the next, the epipolar geometry gives the rotation.
// Between the right stamps, the gyroscope's rotation differs from it by its bias, which is
// constant; between wrong ones, also by what the rotation rate has changed meanwhile. Until one of
// the two is clearly better, the first stamp is right. No clock; deterministic.

#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <optional>

#include "core/camera_model.h"
#include "vio/front_end/tracks.h"

namespace pangea::vio {

class RepeatStamps {
 public:
  // The camera's rotation between two stamps by the gyroscope, whose bias and time offset must not
  // change: maps directions at the first to the second.
  using Rotation = std::function<Eigen::Quaterniond(int64_t from_utime, int64_t to_utime)>;

  explicit RepeatStamps(const CameraModel& camera) : camera_(camera) {}

  // A new image. `rotation` is asked for times between oldest_utime() and that of the image.
  void AddNew(const TrackedFrame& frame, const Rotation& rotation);
  // The newest image came again.
  void AddRepeat(int64_t utime);
  bool last_is_right() const { return last_is_right_; }
  // The tracks end here: the next image is not compared with earlier ones.
  void EndTracks();
  std::optional<int64_t> oldest_utime() const;

 private:
  struct Run {
    TrackedFrame frame;  // its utime is the first stamp
    int64_t last_utime = 0;
  };
  // Of the gyroscope's errors, rad/s.
  struct Moments {
    double count = 0;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double sum_of_squares = 0;
    void Add(const Eigen::Vector3d& value);
    double Variance() const;
  };

  std::optional<Eigen::Vector3d> Error(const Eigen::Quaterniond& q_now_before) const;
  void Compare(const Rotation& rotation);

  CameraModel camera_;
  std::optional<Run> before_, newest_;
  Moments by_first_, by_last_;
  bool last_is_right_ = false;
};

}  // namespace pangea::vio
