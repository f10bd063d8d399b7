#pragma once

// The epipolar constraint of a pair of images whose rotation the gyroscope tells: for points with
// rays m_a, m_b (z = 1), each rotated into one frame at the time of its row,
//   e = v . (R_a m_a  x  R_b m_b),
// v the translation between the two rows, up to scale and free in each pair. The residual is
// Sampson's distance in raw pixels u,
//   r = e / |(d e / d u_a, d e / d u_b)|:
// in undistorted ones a lens that pulls points inwards would have smaller residuals for nothing.
// Hartley & Zisserman, 2nd ed., 11.4.3. With rows at t_a, t_b seconds from their images' middle and
// shares s_a, s_b of the image's height from it (-1/2 to 1/2)
//   v = d (1 + (t_b - t_a) / T) + s_b b - s_a a,
// d from middle row to middle row in T seconds; a and b take up that the velocity changes. They do
// not depend on the read-out, or a longer one would make changes cheap. Rows of an image rotate at
// a constant rate.

#include <Eigen/Core>
#include <span>
#include <vector>

#include "calibration/frame_pairs.h"
#include "calibration/orientation_curve.h"
#include "calibration/parameters.h"

namespace pangea::calibration {

// d (of length 1), a, b.
using Translation = Eigen::Matrix<double, 9, 1>;

// Of a pair's points, the ray (x, y, 1) and d (x, y) / d pixel; not a number where the camera has
// none.
struct PointRay {
  Eigen::Vector2d xy;
  Eigen::Matrix2d d_pixel;
};
struct PairRays {
  std::vector<PointRay> a, b;
};
PairRays Unprojected(const FramePair& pair, const CameraModel& camera);

// One pair's points in the curve's frame. `rays` are the pair's for these parameters;
// `velocity_change` is a standard deviation, as a share of the mean velocity.
class PairGeometry {
 public:
  PairGeometry(const FramePair& pair, const PairRays& rays, const Parameters& parameters,
               const OrientationCurve& curve, double velocity_change);

  // Standard deviation of a and b, with d of length 1.
  double ChangeSigma() const { return velocity_change_ * kUsualReadout_s / seconds_; }
  // What a and b cost.
  double ChangeCost(const Translation& translation) const {
    return 0.5 * translation.tail<6>().squaredNorm() / (ChangeSigma() * ChangeSigma());
  }
  Eigen::Index size() const { return normals_.cols(); }
  // The translation that fits best, weighted; from `start` (zero: none).
  Translation BestTranslation(const Eigen::VectorXd& weights, const Translation& start) const;
  // In pixels; kNoRay_px for a point without a ray, so that no camera gains by having none.
  static constexpr double kNoRay_px = 20;
  Eigen::VectorXd Residuals(const Translation& translation) const;

 private:
  struct View {
    Eigen::Vector3d ray;                  // R m
    Eigen::Matrix<double, 3, 2> d_pixel;  // d (R m) / d pixel
    double share;                         // of the image's height, from the middle row
    double row_s;
  };
  bool HasRay(Eigen::Index point) const { return normals_.col(point).allFinite(); }
  // Pixels for each unit of e.
  double Gain(Eigen::Index point, const Eigen::Vector3d& v) const;
  // Of d, a and b in v.
  Eigen::Matrix<double, 1, 3> Shares(Eigen::Index point) const;
  // v of the point's two rows.
  Eigen::Vector3d RowToRow(Eigen::Index point, const Translation& translation) const;

  static constexpr double kUsualReadout_s = 0.02;

  double focal_;
  double velocity_change_;
  double seconds_;  // middle row to middle row
  std::vector<View> a_, b_;
  Eigen::Matrix3Xd normals_;  // R_a m_a x R_b m_b
};

}  // namespace pangea::calibration
