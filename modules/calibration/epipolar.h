#pragma once

// The epipolar constraint of a pair of images with the rotation from the gyroscope. For a point
// with rays m_a, m_b (z = 1), each rotated into a common frame at the time of its row,
//   e = v . (R_a m_a  x  R_b m_b),
// with v the translation between the two rows, up to scale and free in each pair. The residual is
// the Sampson distance in raw pixels u,
//   r = e / |(d e / d u_a, d e / d u_b)|:
// in undistorted pixels, a lens that contracts points would have smaller residuals without reason
// (Hartley & Zisserman, 2nd ed., 11.4.3). With rows at t_a, t_b seconds from the middle rows, at
// shares s_a, s_b of the image height from the middle (-1/2 to 1/2),
//   v = d (1 + (t_b - t_a) / T) + s_b b - s_a a,
// with d the translation between the middle rows, in T seconds; a and b model changes of the
// velocity. Their prior does not depend on the read-out time, or a longer one would make changes
// cheaper. Within an image the rotation rate is constant.

#include <Eigen/Core>
#include <span>
#include <vector>

#include "calibration/frame_pairs.h"
#include "calibration/orientation_curve.h"
#include "calibration/parameters.h"

namespace pangea::calibration {

// d (of length 1), a, b.
using Translation = Eigen::Matrix<double, 9, 1>;

// The ray (x, y, 1) of a point, and d(x, y)/d(pixel); NaN if the camera model has no ray there.
struct PointRay {
  Eigen::Vector2d xy;
  Eigen::Matrix2d d_pixel;
};
struct PairRays {
  std::vector<PointRay> a, b;
};
PairRays Unprojected(const FramePair& pair, const CameraModel& camera);

// One pair's points in the orientation curve's frame. `rays`: of the pair, for these parameters.
// `velocity_change`: standard deviation, relative to the mean velocity.
class PairGeometry {
 public:
  PairGeometry(const FramePair& pair, const PairRays& rays, const Parameters& parameters,
               const OrientationCurve& curve, double velocity_change);

  // Standard deviation of a and b, for d of length 1.
  double ChangeSigma() const { return velocity_change_ * kUsualReadout_s / seconds_; }
  // Cost of the prior on a and b.
  double ChangeCost(const Translation& translation) const {
    return 0.5 * translation.tail<6>().squaredNorm() / (ChangeSigma() * ChangeSigma());
  }
  Eigen::Index size() const { return normals_.cols(); }
  // The weighted best translation; starts from `start` (zero: no initial value).
  Translation BestTranslation(const Eigen::VectorXd& weights, const Translation& start) const;
  // In pixels; kNoRay_px for a point without a ray, so that a camera model gains nothing by lacking
  // rays.
  static constexpr double kNoRay_px = 20;
  Eigen::VectorXd Residuals(const Translation& translation) const;

 private:
  struct View {
    Eigen::Vector3d ray;                  // R m
    Eigen::Matrix<double, 3, 2> d_pixel;  // d (R m) / d pixel
    double share;                         // distance from the middle row, as a share of the height
    double row_s;
  };
  bool HasRay(Eigen::Index point) const { return normals_.col(point).allFinite(); }
  // Pixels per unit of e.
  double Gain(Eigen::Index point, const Eigen::Vector3d& v) const;
  // Coefficients of d, a and b in v.
  Eigen::Matrix<double, 1, 3> Shares(Eigen::Index point) const;
  // v between the point's two rows.
  Eigen::Vector3d RowToRow(Eigen::Index point, const Translation& translation) const;

  static constexpr double kUsualReadout_s = 0.02;

  double focal_;
  double velocity_change_;
  double seconds_;  // middle row to middle row
  std::vector<View> a_, b_;
  Eigen::Matrix3Xd normals_;  // R_a m_a x R_b m_b
};

}  // namespace pangea::calibration
