#pragma once

// Finds the tracks between two images that agree with one rigid motion of the camera.
//
// The rotation is known from the gyroscope up to its bias, so two points give the direction of
// translation (Troiani et al., "2-Point-Based Outlier Rejection for Camera-IMU Systems", ICRA
// 2014); the best hypothesis is then refined together with the rotation, robustly, with the gyro as
// a prior. At standstill and in pure rotation every direction of translation fits, so no track is
// rejected that agrees with the rotation. Input and output are rays (x, y, 1) in the camera frame.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

namespace pangea::vio {

struct TwoViewOptions {
  double inlier_px = 1.2;        // distance to the epipolar line
  double rotation_sigma = 4e-3;  // radians, error of the gyro's rotation between the images

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("inlier_px", &inlier_px, {0.05, 100}, "px", "distance to the epipolar line");
    archive.Add("rotation_sigma", &rotation_sigma, {1e-6, 1}, "rad",
                "of the gyro between the two images");
  }
};

struct TwoViewResult {
  std::vector<bool> inlier;
  Eigen::Quaterniond q_b_a = Eigen::Quaterniond::Identity();  // refined rotation
  int num_inliers = 0;
};

// `rays_a[i]` and `rays_b[i]` belong to one track. `q_b_a` maps directions from camera a to camera
// b. `pixel_angle` is the angle of a pixel, radians.
TwoViewResult CheckTwoView(const std::vector<Eigen::Vector2d>& rays_a,
                           const std::vector<Eigen::Vector2d>& rays_b,
                           const Eigen::Quaterniond& q_b_a, double pixel_angle,
                           const TwoViewOptions& options);

}  // namespace pangea::vio
