#pragma once

// Cameras for tests.

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/camera_model.h"

namespace pangea {

// q_body_cam of a level camera (z forward, x right, y down) that looks along the body's x axis.
inline Eigen::Quaterniond LookingAhead() {
  Eigen::Matrix3d R_body_cam;
  R_body_cam << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return Eigen::Quaterniond(R_body_cam);
}

// A camera without distortion, with the principal point in the middle.
inline CameraModel PinholeTestCamera(int width, int height, double focal_px) {
  CameraModel camera;
  camera.width = width;
  camera.height = height;
  camera.fx = camera.fy = focal_px;
  camera.cx = 0.5 * (width - 1);
  camera.cy = 0.5 * (height - 1);
  return camera;
}

// EuRoC's left camera, looking ahead.
inline CameraModel EurocTestCamera() {
  CameraModel camera;
  camera.width = 752;
  camera.height = 480;
  camera.fx = 458.654;
  camera.fy = 457.296;
  camera.cx = 367.215;
  camera.cy = 248.375;
  camera.distortion << -0.28340811, 0.07395907, 0.00019359, 1.76187114e-05;
  camera.T_body_cam = {LookingAhead(), {0.05, 0.02, 0.01}};
  return camera;
}

}  // namespace pangea
