#pragma once

// Input and output of a bundle adjustment: keyframes, cameras, landmarks and observations.

#include <optional>
#include <vector>

#include "core/ids.h"
#include "core/imu/imu_factor.h"

namespace pangea {

struct KeyframeState {
  Rigid3 T_map_body;
  Eigen::Vector3d v_map_body = Eigen::Vector3d::Zero();  // m/s
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();   // rad/s
  Eigen::Vector3d accel_bias = Eigen::Vector3d::Zero();  // m/s^2
};

struct BaEdge {
  Rigid3 T_previous_this;
  Matrix6d covariance = Matrix6d::Identity();
};

struct BaKeyframe {
  KeyframeId id;
  int64_t utime = 0;
  int camera = 0;  // index into BaWorld::cameras
  KeyframeState state;
  // Preintegration and odometry edge from keyframe `previous` of the world to this one; either may
  // be missing. -1 and empty at the start of a map or of a part of it.
  int previous = -1;
  std::optional<Preintegration> preintegration;
  std::optional<BaEdge> edge;
  double unknown_scale = 0;  // sigma of its map's scale; 0 for a metric map
  bool fixed = false;        // the keyframe's variables are fixed
};

// Variables shared by the keyframes of a map.
struct BaCamera {
  Rigid3 T_body_cam;
  Rigid3 T_body_cam_prior = T_body_cam;  // the odometry's estimate
  double edge_log_scale = 0;  // the map's edges are too long by the factor exp(edge_log_scale)
  bool fixed = false;         // fixed; else edge_log_scale starts at zero
};

struct BaObservation {
  int keyframe = 0;
  int landmark = 0;
  Eigen::Vector2d ray = Eigen::Vector2d::Zero();  // on the camera's plane z = 1
  Eigen::Matrix2d sqrt_info = Eigen::Matrix2d::Identity();
};

// Indices refer to its own vectors. A keyframe comes after its `previous`.
struct BaWorld {
  std::vector<BaCamera> cameras;
  std::vector<BaKeyframe> keyframes;
  std::vector<Eigen::Vector3d> landmarks;  // map frame
  std::vector<BaObservation> observations;
};

// Removes landmarks seen by fewer than two keyframes, with their observations.
void DropUnderobservedLandmarks(BaWorld* world);

}  // namespace pangea
