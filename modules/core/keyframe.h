#pragma once

// A keyframe as every module past the border sees it: bounded, finite, undistortion still to come.

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/camera_model.h"
#include "core/descriptor.h"
#include "core/ids.h"
#include "core/imu/preintegration.h"
#include "core/rigid3.h"

namespace pangea {

inline constexpr int kMaxCorners = 700;
inline constexpr int32_t kNoLandmark = -1;
inline constexpr double kMaxScaleSigma = 1;  // nothing is known
// A map whose scale is known better is metric.
inline constexpr double kMetricScaleSigma = 0.03;

// 0 for a metric one.
inline double UnknownScaleSigma(double scale_sigma) {
  return scale_sigma > kMetricScaleSigma ? scale_sigma : 0;
}

// Of a map, by what its keyframes say: the first ones know least. 0 for no keyframes, too.
double UnknownScaleSigma(const std::vector<double>& scale_sigmas);

struct Corner {
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();  // raw (distorted); on the wire in 1/16 px
  int8_t octave = 0;                                // pyramid level
  Descriptor descriptor{};
  int32_t landmark_id = kNoLandmark;  // unique in its map, the same in every keyframe that saw it
};

// Powers of kOctaveScale: of the octaves that a message may have.
inline constexpr int kNumOctaves = 16;
extern const std::array<double, kNumOctaves> kOctaveScales;

// Of a corner's pixel: grows with each octave (keyframe_t).
inline double CornerSigma(const Corner& corner, double sigma_on_octave_0) {
  const bool known = corner.octave >= 0 && corner.octave < kNumOctaves;
  return sigma_on_octave_0 *
         (known ? kOctaveScales[corner.octave] : std::pow(kOctaveScale, corner.octave));
}

struct MapPoint {
  int corner = 0;               // index into Keyframe::corners
  float inverse_depth = 0;      // 1/m, along the camera's z axis, > 0
  float inverse_depth_var = 0;  // 1/m^2, > 0
};

// Relative pose to an earlier keyframe of the same map.
struct OdometryEdge {
  int32_t from_seq = 0;
  Rigid3 T_from_this;
  Matrix6d covariance = Matrix6d::Identity();  // (translation, rotation) in from's body frame
};

struct Keyframe {
  KeyframeId id;
  int64_t utime = 0;  // microseconds, the agent's sensor clock
  CameraModel camera;
  Rigid3 T_odom_body;
  Eigen::Vector3d v_odom_body = Eigen::Vector3d::Zero();  // m/s
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();    // rad/s
  Eigen::Vector3d accel_bias = Eigen::Vector3d::Zero();   // m/s^2
  // Rotation error about odom x and y, rad^2.
  Eigen::Matrix2d roll_pitch_covariance = Eigen::Matrix2d::Identity() * 1e-4;
  std::optional<OdometryEdge> edge;              // none in a map's first keyframe
  std::optional<Preintegration> preintegration;  // from the edge's keyframe to this one
  std::vector<Corner> corners;
  std::vector<MapPoint> points;
  int64_t group_revision = 0;  // newest correction the agent had applied
  // What all keyframes of a map share, so that no covariance above has it:
  double scale_sigma = 0;  // of all lengths, a share, at most kMaxScaleSigma; 0: not doubted
  Matrix6d T_body_cam_covariance = Matrix6d::Zero();  // left frame; zero: as good as exact

  Rigid3 T_odom_cam() const { return T_odom_body * camera.T_body_cam; }
};

// The map point's position in the keyframe's camera frame, metres; nothing where the corner's pixel
// cannot be undistorted.
std::optional<Eigen::Vector3d> PointInCamera(const Keyframe& keyframe, const MapPoint& point);

}  // namespace pangea
