#pragma once

// Counts the images that got a pose, and why the others have none.

#include <cstdint>
#include <map>
#include <optional>
#include <string>

namespace pangea::vio {

class PoseCount {
 public:
  // An image with a pose, and one without. `suspect`: what is probably wrong with the calibration;
  // empty: not known.
  void AddPose(int64_t utime, const std::string& suspect);
  void AddNone(int64_t utime, const std::string& reason, const std::string& suspect);

  int64_t images() const { return images_; }
  int64_t poses() const { return poses_; }
  // A text for people if fewer than half of the images have a pose, apart from the first seconds,
  // in which an odometry may start; or of those since a suspect came up; or if the newest pose has
  // a suspect.
  std::optional<std::string> WhyFew() const;

 private:
  struct Reason {
    int64_t images = 0;
    std::string newest;  // with its numbers
  };
  void Add(int64_t utime);
  bool AreFew() const;
  std::string Reasons() const;

  std::optional<int64_t> first_utime_;
  int64_t images_ = 0;
  int64_t poses_ = 0;
  int64_t late_images_ = 0;                // after the time for the start
  std::map<std::string, Reason> reasons_;  // by their text without numbers
  std::string last_reason_;
  std::string suspect_;
  bool is_pose_suspect_ = false;  // the newest one
  int64_t images_since_suspect_ = 0;
  int64_t poses_since_suspect_ = 0;
};

}  // namespace pangea::vio
