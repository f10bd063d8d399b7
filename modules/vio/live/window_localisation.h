#pragma once

// Aligns an agent's window with the fused map, by landmarks of the map that its keyframes see (like
// the relocalisation of VINS-Mono, Qin et al., TRO 2018, section VII, but with free old poses).
//
//   min  |x_window|^2_P + sum_sources |x_source|^2 + sum_landmarks rho(|r|^2)
//
// The unknowns are the errors of the window's poses in the map and, for each source keyframe of
// landmarks, a shift and a yaw of all its landmarks. P is the odometry's marginal covariance of the
// window, in which position and yaw of the first pose are replaced by those of the server's
// correction. A landmark's own error is marginalised out of its residuals.
//
// Nothing is fed back to the odometry: what it publishes is independent of the server's messages.

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "core/rigid3.h"
#include "vio/window/window_poses.h"

namespace pangea::vio {

// The estimate without landmarks.
struct LocalizationPrior {
  Rigid3 T_map_odom;  // only translation and yaw
  // Of the window's first pose in the map: (x, y, z, yaw), in map axes, yaw about the pose itself.
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Identity();
};

// A landmark with all its observations in the window.
struct SeenLandmark {
  struct Ray {
    int pose = 0;                                   // index into WindowPoses
    Eigen::Vector2d ray = Eigen::Vector2d::Zero();  // in the camera, z = 1
    double sigma = 0;                               // in units of the ray
  };
  int source = 0;
  Eigen::Vector3d p_map = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();  // in map axes
  std::vector<Ray> rays;
};

struct LocalizationOptions {
  // Sigmas of the error of a source keyframe relative to its neighbours in the map.
  double source_position_sigma = 0.01;  // m
  double source_yaw_sigma = 0.002;      // rad
  int min_landmarks = 8;                // that must fit
  double max_landmark_chi2 = 2.5;       // per degree of freedom, of a fitting landmark
  double max_prior_chi2 = 18.5;         // four degrees of freedom, 99.9 %
};

struct LocalizationResult {
  Rigid3 T_map_odom;  // translation and yaw, exact at the newest pose
  // Of the newest pose in the map, in the form of LocalizationPrior.
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Identity();
  int num_fitting = 0;
  double prior_chi2 = 0;   // Mahalanobis^2 of the first pose's shift by the landmarks
  std::vector<bool> fits;  // per landmark
};

// Empty if too few landmarks fit or they contradict the prior. `source_positions`: positions of the
// source cameras in the map, indexed by SeenLandmark::source.
std::optional<LocalizationResult> LocalizeWindow(
    const WindowPoses& window, const Rigid3& T_body_cam, const LocalizationPrior& prior,
    const std::vector<Eigen::Vector3d>& source_positions,
    const std::vector<SeenLandmark>& landmarks, const LocalizationOptions& options);

}  // namespace pangea::vio
