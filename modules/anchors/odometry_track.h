#pragma once

// The data of an agent's map that anchors need: the odometry pose of each keyframe (about 300 bytes
// in memory) and, to place an anchor behind a pixel, its map points (about 5 kB in a RecordStore,
// or in memory if that has no room).

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "core/keyframe.h"
#include "core/record_store.h"

namespace pangea {

struct TrackedPoint {
  int32_t landmark_id = kNoLandmark;
  Eigen::Vector3f p_cam = Eigen::Vector3f::Zero();  // in the keyframe's camera, metres
  float relative_depth_sigma = 0;                   // standard deviation / depth
};

struct TrackedKeyframe {
  explicit TrackedKeyframe(Record its_points) : points(std::move(its_points)) {}

  int64_t utime = 0;
  Rigid3 T_odom_body;
  Eigen::Vector3d v_odom_body = Eigen::Vector3d::Zero();
  // Variances, per axis, of the odometry edge from the previous keyframe; infinite without an edge.
  double edge_position_variance_m2 = 0;
  double edge_rotation_variance_rad2 = 0;
  std::shared_ptr<const CameraModel> camera;  // shared by keyframes with the same camera
  Record points;

  Rigid3 T_odom_cam() const { return T_odom_body * camera->T_body_cam; }
};

// The keyframes of one map.
class OdometryTrack {
 public:
  using Keyframes = std::map<int32_t, TrackedKeyframe>;  // by seq

  // `records` may be null; it must outlive the track.
  explicit OdometryTrack(RecordStore* records = nullptr) : records_(records) {}

  void Add(const Keyframe& keyframe);

  const Keyframes& keyframes() const { return keyframes_; }
  // Null if there is no such keyframe.
  const TrackedKeyframe* Find(int32_t seq) const;
  // The keyframe nearest in time. The track must not be empty.
  Keyframes::const_iterator Nearest(int64_t utime) const;
  // Body pose at a time between two keyframes: a cubic through their positions and velocities; the
  // rotation by slerp. Empty outside the track.
  std::optional<Rigid3> Between(int64_t utime) const;
  // Variances (m^2, rad^2) of the odometry between two keyframes, summed over the edges.
  std::pair<double, double> Drift(int32_t seq_a, int32_t seq_b) const;
  // Empty if they cannot be read; this is counted.
  std::vector<TrackedPoint> Points(const TrackedKeyframe& keyframe) const;
  const RecordCounters& counters() const { return counters_; }

 private:
  RecordStore* records_;
  mutable RecordCounters counters_;
  Keyframes keyframes_;
};

}  // namespace pangea
