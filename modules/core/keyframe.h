#pragma once

// The keyframe as a domain type, parsed from keyframe_t (messages/messages.h): all its values are
// finite and within bounds. Its pixels are raw (distorted).

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
#include "core/tags/tag.h"

namespace pangea {

inline constexpr int kMaxCorners = 700;
inline constexpr int32_t kNoLandmark = -1;
inline constexpr double kMaxScaleSigma = 1;  // the scale is not known at all
// A map is metric if the standard deviation of its scale, as a share, is at most this.
inline constexpr double kMetricScaleSigma = 0.03;

// The given standard deviation of a map's scale; 0 if it makes the map metric.
inline double UnknownScaleSigma(double scale_sigma) {
  return scale_sigma > kMetricScaleSigma ? scale_sigma : 0;
}

// The same for a whole map: it uses the median over the keyframes, because the first keyframes know
// the scale least. Those that do not know it at all yet (0) do not count, unless all are 0.
double UnknownScaleSigma(const std::vector<double>& scale_sigmas);

struct Corner {
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();  // raw (distorted); in messages in 1/16 px
  int8_t octave = 0;                                // pyramid level
  Descriptor descriptor{};
  int32_t landmark_id = kNoLandmark;  // unique in its map; all keyframes that saw it use the same
};

// kOctaveScale to the power of each octave. A message has octaves below kNumOctaves.
inline constexpr int kNumOctaves = 16;
extern const std::array<double, kNumOctaves> kOctaveScales;

// Standard deviation of a corner's pixel, per axis. It grows by kOctaveScale with each octave.
inline double CornerSigma(const Corner& corner, double sigma_on_octave_0) {
  const bool known = corner.octave >= 0 && corner.octave < kNumOctaves;
  return sigma_on_octave_0 *
         (known ? kOctaveScales[corner.octave] : std::pow(kOctaveScale, corner.octave));
}

struct MapPoint {
  int corner = 0;               // index into Keyframe::corners
  float inverse_depth = 0;      // 1/m, along the camera's z axis, > 0
  float inverse_depth_var = 0;  // variance, 1/m^2, > 0
};

// Relative pose of a keyframe ("this") to an earlier keyframe of the same map ("from").
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
  // Covariance of roll and pitch: rotation about the x and y axes of odom, rad^2.
  Eigen::Matrix2d roll_pitch_covariance = Eigen::Matrix2d::Identity() * 1e-4;
  std::optional<OdometryEdge> edge;              // none in a map's first keyframe, or after a gap
  std::optional<Preintegration> preintegration;  // from keyframe edge->from_seq to this one
  DescriptorKind descriptor_kind = DescriptorKind::kOrb;
  std::vector<Corner> corners;
  std::vector<MapPoint> points;
  std::vector<TagObservation> tags;  // at most kMaxTags, each with another identity
  int64_t group_revision = 0;        // of the newest correction that the agent had applied; 0: none
  // Errors that all keyframes of a map share. The covariances above do not include them.
  double scale_sigma = 0;  // share of lengths, at most kMaxScaleSigma; 0: exact, or no depth yet
  Matrix6d T_body_cam_covariance = Matrix6d::Zero();  // (translation, rotation), body; 0: exact

  Rigid3 T_odom_cam() const { return T_odom_body * camera.T_body_cam; }
};

// Position of the map point in the keyframe's camera frame, metres. Nothing if the corner's pixel
// cannot be undistorted.
std::optional<Eigen::Vector3d> PointInCamera(const Keyframe& keyframe, const MapPoint& point);

}  // namespace pangea
