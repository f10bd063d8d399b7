#pragma once

// Where an agent's window lies in the fused map, from landmarks of the map that its keyframes see
// (relocalisation as VINS-Mono does it, Qin et al., TRO 2018, section VII: the old poses are free).
//
//   min  |x_window|^2_P + sum_sources |x_source|^2 + sum_landmarks rho(|r|^2)
//
// Unknown are the errors of the window's poses in the map and, for each keyframe that landmarks
// come from, a shift and a yaw of all that it saw. P, of the window, is the odometry's own marginal
// with position and yaw given up and known again as the server's correction knows them at the
// window's first pose. A landmark's own error is integrated out of its residuals.
//
// Nothing comes back to the odometry: what it publishes is independent of what the server said.

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "core/rigid3.h"
#include "vio/window/window_poses.h"

namespace pangea::vio {

// What is known without the landmarks.
struct LocalizationPrior {
  Rigid3 T_map_odom;  // a shift and a yaw
  // Of the window's first pose in the map: x, y, z, yaw (map axes, yaw about the pose itself).
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Identity();
};

// A landmark with all that the window saw of it.
struct SeenLandmark {
  struct Ray {
    int pose = 0;                                   // index into the window's
    Eigen::Vector2d ray = Eigen::Vector2d::Zero();  // camera, z = 1
    double sigma = 0;                               // the same unit
  };
  int source = 0;
  Eigen::Vector3d p_map = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();  // in map axes
  std::vector<Ray> rays;
};

struct LocalizationOptions {
  // How far a keyframe of the map may be off against its neighbours.
  double source_position_sigma = 0.01;  // m
  double source_yaw_sigma = 0.002;      // rad
  int min_landmarks = 8;                // that fit
  double max_landmark_chi2 = 2.5;       // a degree of freedom, of one that fits
  double max_prior_chi2 = 18.5;         // four degrees of freedom, 99.9 %
};

struct LocalizationResult {
  Rigid3 T_map_odom;  // a shift and a yaw, such that the newest pose is where it was found
  // Of the newest pose in the map, as the prior's.
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Identity();
  int num_fitting = 0;
  double prior_chi2 = 0;   // of the first pose: how far the landmarks moved it
  std::vector<bool> fits;  // each landmark
};

// Nothing when too few landmarks fit or they contradict the prior. `source_positions`: in the map.
std::optional<LocalizationResult> LocalizeWindow(
    const WindowPoses& window, const Rigid3& T_body_cam, const LocalizationPrior& prior,
    const std::vector<Eigen::Vector3d>& source_positions,
    const std::vector<SeenLandmark>& landmarks, const LocalizationOptions& options);

}  // namespace pangea::vio
