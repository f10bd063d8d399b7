#pragma once

// What anchors need of an agent's map: where its odometry had each keyframe, and the points it saw.
// About 2 kB a keyframe, without corners and descriptors.

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "core/keyframe.h"

namespace pangea {

struct TrackedPoint {
  int32_t landmark_id = kNoLandmark;
  Eigen::Vector3f p_cam = Eigen::Vector3f::Zero();  // of the keyframe's camera, metres
  float relative_depth_sigma = 0;                   // standard deviation / depth
};

struct TrackedKeyframe {
  int64_t utime = 0;
  Rigid3 T_odom_body;
  Eigen::Vector3d v_odom_body = Eigen::Vector3d::Zero();
  // Of the odometry edge from the keyframe before; infinite where there is none.
  double edge_position_variance_m2 = 0;
  double edge_rotation_variance_rad2 = 0;
  std::shared_ptr<const CameraModel> camera;  // one of all keyframes that have the same
  std::vector<TrackedPoint> points;

  Rigid3 T_odom_cam() const { return T_odom_body * camera->T_body_cam; }
};

// The keyframes of one map.
class OdometryTrack {
 public:
  using Keyframes = std::map<int32_t, TrackedKeyframe>;  // by seq

  void Add(const Keyframe& keyframe);

  const Keyframes& keyframes() const { return keyframes_; }
  // Null when it is not there.
  const TrackedKeyframe* Find(int32_t seq) const;
  // The keyframe nearest in time. Only of a track that is not empty.
  Keyframes::const_iterator Nearest(int64_t utime) const;
  // The body at a time between two keyframes: a cubic through their positions and velocities, the
  // rotation in between. Nothing outside.
  std::optional<Rigid3> Between(int64_t utime) const;
  // Variances (m^2, rad^2) of the odometry between two keyframes, summed over the edges.
  std::pair<double, double> Drift(int32_t seq_a, int32_t seq_b) const;

 private:
  Keyframes keyframes_;
};

}  // namespace pangea
