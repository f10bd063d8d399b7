#pragma once

// What a bundle adjustment starts with and ends with: keyframes, cameras, landmarks, and what is
// seen of them.

#include <optional>
#include <vector>

#include "core/ids.h"
#include "core/imu/imu_factor.h"

namespace pangea {

struct BaEdge {
  Rigid3 T_previous_this;
  Matrix6d covariance = Matrix6d::Identity();
};

struct BaKeyframe {
  KeyframeId id;
  int64_t utime = 0;
  int camera = 0;  // of the world's
  ImuState imu;    // odom is the group's map frame here
  // The IMU and the odometry since keyframe `previous` of the world; none where a map or a piece
  // of it begins.
  int previous = -1;
  std::optional<Preintegration> preintegration;
  std::optional<BaEdge> edge;
  double unknown_scale = 0;  // sigma of its map's scale; 0 for a metric map
  bool held = false;         // stays as it is
};

// What the keyframes of a map have in common.
struct BaCamera {
  Rigid3 T_body_cam;
  double edge_log_scale = 0;  // how much longer the map's edges are than they should be
  bool held = false;          // stays as it is; otherwise edge_log_scale starts at zero
};

struct BaObservation {
  int keyframe = 0;
  int landmark = 0;
  Eigen::Vector2d ray = Eigen::Vector2d::Zero();  // on the camera's plane z = 1
  Eigen::Matrix2d sqrt_info = Eigen::Matrix2d::Identity();
};

// Indices are into its own vectors. A keyframe comes after its `previous`.
struct BaWorld {
  std::vector<BaCamera> cameras;
  std::vector<BaKeyframe> keyframes;
  std::vector<Eigen::Vector3d> landmarks;  // map frame
  std::vector<BaObservation> observations;
};

// Takes out landmarks that fewer than two keyframes see, and what is seen of them.
void DropUnderobservedLandmarks(BaWorld* world);

}  // namespace pangea
