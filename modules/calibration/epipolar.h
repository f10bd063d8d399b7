#pragma once

// The epipolar constraint of a pair of images whose rotation the gyroscope tells: for points with
// rays m_a, m_b (z = 1), each rotated into one frame at the time of its row,
//   e = v . (R_a m_a  x  R_b m_b),
// v the direction of translation, free in each pair. The residual is Sampson's distance in pixels,
//   r = f e / |(d e / d m_a, d e / d m_b)|.
// Hartley & Zisserman, 2nd ed., 11.4.3. v constant within a pair; rows at a constant rate.

#include <Eigen/Core>
#include <span>
#include <vector>

#include "calibration/frame_pairs.h"
#include "calibration/orientation_curve.h"
#include "calibration/parameters.h"

namespace pangea::calibration {

// Rays (x, y, 1) of a pair's points; not a number where the camera has none.
struct PairRays {
  Eigen::Matrix2Xd a, b;
};
PairRays Unprojected(const FramePair& pair, const CameraModel& camera);

// One pair's points in the curve's frame. `rays` are the pair's for these parameters.
class PairGeometry {
 public:
  PairGeometry(const FramePair& pair, const PairRays& rays, const Parameters& parameters,
               const OrientationCurve& curve);

  Eigen::Index size() const { return normals_.cols(); }
  // The direction that fits best, weighted; from `start` (zero: none).
  Eigen::Vector3d Direction(const Eigen::VectorXd& weights, const Eigen::Vector3d& start) const;
  // In pixels; kNoRay_px for a point without a ray, so that no camera gains by having none.
  static constexpr double kNoRay_px = 20;
  Eigen::VectorXd Residuals(const Eigen::Vector3d& direction) const;

 private:
  struct View {
    Eigen::Vector3d ray;    // R m
    Eigen::Vector3d right;  // R's first two columns
    Eigen::Vector3d down;
  };
  bool HasRay(Eigen::Index point) const { return normals_.col(point).allFinite(); }
  // Pixels for each unit of e.
  double Gain(Eigen::Index point, const Eigen::Vector3d& direction) const;

  double focal_;
  std::vector<View> a_, b_;
  Eigen::Matrix3Xd normals_;  // R_a m_a x R_b m_b
};

}  // namespace pangea::calibration
