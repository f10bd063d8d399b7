#pragma once

// Any odometry as an agent: images and the poses it has for them in, keyframes out.
//
// What a server needs of a keyframe beside its pose: corners with descriptors, map points with
// depths, and how far to trust the step from the keyframe before. Features are followed by the
// project's own tracker and described by its own describer, since corners match only if they are
// described the same way; depths are triangulated with the given poses.

#include <Eigen/Core>
#include <deque>
#include <map>
#include <opencv2/core.hpp>
#include <optional>

#include "core/keyframe.h"
#include "vio/front_end/describer.h"
#include "vio/front_end/tracker.h"

namespace pangea {

struct KeyframeMakerOptions {
  // A keyframe after so much motion, or so long.
  double keyframe_distance_m = 0.3;
  double keyframe_angle = 0.25;  // radians
  double keyframe_interval_s = 1;
  // What the odometry errs from one keyframe to the next, standard deviations.
  double edge_sigma_m = 0.01;
  double edge_sigma_yaw = 0.002;    // radians
  double tilt_sigma = 0.003;        // radians, roll and pitch
  double triangulation_px = 1.0;    // of a track under the odometry's poses
  double max_relative_sigma = 0.2;  // of a depth that is worth sending
};

class KeyframeMaker {
 public:
  // `map`: a new one for each run of the odometry, and whenever it starts again.
  KeyframeMaker(const MapId& map, const CameraModel& camera, const KeyframeMakerOptions& options);

  // `T_odom_body`: body is the IMU (or any frame that `camera.T_body_cam` refers to); odom's z
  // points up. In time order. A keyframe when it is time for one.
  std::optional<Keyframe> Add(int64_t utime, const cv::Mat& image, const Rigid3& T_odom_body);
  // Features in the newest image.
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
  vio::Describer describer_;
  KeyframeId next_;
  std::optional<Step> last_, last_keyframe_;
  std::map<int32_t, std::deque<Observation>> observations_;  // by landmark
};

}  // namespace pangea
