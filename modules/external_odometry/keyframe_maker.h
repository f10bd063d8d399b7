#pragma once

// Makes keyframes from any odometry: images and their poses in, keyframes out.
//
// Beside the pose, the server needs corners with descriptors, map points with depths, and an
// odometry edge with covariance from the previous keyframe. Features are tracked and described by
// the project's own tracker and describer, since corners match only if they are described the same
// way. Depths are triangulated with the given poses.

#include <Eigen/Core>
#include <deque>
#include <map>
#include <opencv2/core.hpp>
#include <optional>

#include "core/keyframe.h"
#include "vio/front_end/describer.h"
#include "vio/front_end/repeated_images.h"
#include "vio/front_end/tracker.h"

namespace pangea {

struct KeyframeMakerOptions {
  // A keyframe is made after this distance, this rotation, or this time.
  double keyframe_distance_m = 0.3;
  double keyframe_angle = 0.25;  // radians
  double keyframe_interval_s = 1;
  // Standard deviations of the odometry's error from one keyframe to the next.
  double edge_sigma_m = 0.01;
  double edge_sigma_yaw = 0.002;    // radians
  double tilt_sigma = 0.003;        // radians, of roll and pitch
  double triangulation_px = 1.0;    // sigma of a tracked corner, with the odometry's pose errors
  double max_relative_sigma = 0.2;  // largest of a depth that is published
};

class KeyframeMaker {
 public:
  // `map`: must be a new one whenever the odometry starts.
  KeyframeMaker(const MapId& map, const CameraModel& camera, const KeyframeMakerOptions& options);

  // `T_odom_body`: body is the IMU (or the frame that `camera.T_body_cam` refers to); the z axis of
  // odom points up. Call with ascending `utime`. Returns a keyframe if one is due. An image that
  // repeats the last one (repeated_images.h) does not belong to its pose, and is ignored.
  std::optional<Keyframe> Add(int64_t utime, const cv::Mat& image, const Rigid3& T_odom_body);
  // Number of features in the newest image.
  int num_tracked() const { return static_cast<int>(observations_.size()); }

 private:
  struct Observation {
    Rigid3 T_odom_cam;
    Eigen::Vector2d ray;
  };
  struct Step {
    int64_t utime = 0;
    Rigid3 T_odom_body;
  };

  bool IsDue(const Step& now) const;
  Keyframe Make(const cv::Mat& image, const vio::TrackedFrame& frame, const Step& now);
  std::optional<MapPoint> Triangulate(int corner, const Corner& of, const Rigid3& T_odom_cam) const;

  KeyframeMakerOptions options_;
  CameraModel camera_;
  vio::Tracker tracker_;
  vio::RepeatedImages repeated_images_;
  vio::Describer describer_;
  KeyframeId next_;
  std::optional<Step> last_, last_keyframe_;
  std::map<int32_t, std::deque<Observation>> observations_;  // by landmark
};

}  // namespace pangea
