#include "calibration/epipolar.h"

#include <Eigen/Eigenvalues>
#include <cmath>

#include "core/rigid3.h"

namespace pangea::calibration {
namespace {

constexpr int kReweightings = 2;
// Pixel noise, relative to which changes of velocity are weighted
constexpr double kNoise_px = 0.5;

// Rotation from the camera to the curve's frame, by row of one image: at the mean rate, to second
// order (error for a read-out of 30 ms at 3 rad/s: 1e-5 rad).
class RowRotation {
 public:
  RowRotation(double image_s, double excess_s, const Parameters& parameters,
              const OrientationCurve& curve)
      : last_row_(parameters.camera.height - 1) {
    const CameraModel& camera = parameters.camera;
    const double first_s = image_s + camera.time_offset_s + parameters.interval_share * excess_s;
    const double last_s = first_s + camera.readout_s;
    const Eigen::Matrix3d R_body_cam = camera.T_body_cam.R();
    middle_ = curve.At(0.5 * (first_s + last_s)) * R_body_cam;
    const Eigen::Matrix3d sweep =
        Hat(R_body_cam.transpose() * LogSo3(curve.At(first_s).conjugate() * curve.At(last_s)));
    linear_ = middle_ * sweep;
    quadratic_ = 0.5 * linear_ * sweep;
  }
  Eigen::Matrix3d At(double row) const {
    const double share = row / last_row_ - 0.5;
    return middle_ + share * linear_ + share * share * quadratic_;
  }

 private:
  double last_row_;
  Eigen::Matrix3d middle_, linear_, quadratic_;
};

PointRay RayOf(const Eigen::Vector2d& pixel, const CameraModel& camera) {
  const auto xy = camera.Unproject(pixel);
  Eigen::Matrix<double, 2, 3> d_ray;
  if (!xy || !camera.Project(xy->homogeneous(), &d_ray)) {
    return {Eigen::Vector2d::Constant(std::nan("")), Eigen::Matrix2d::Zero()};
  }
  return {*xy, d_ray.leftCols<2>().inverse()};
}

}  // namespace

PairRays Unprojected(const FramePair& pair, const CameraModel& camera) {
  PairRays rays;
  for (const PointPair& point : pair.points) {
    rays.a.push_back(RayOf(point.a, camera));
    rays.b.push_back(RayOf(point.b, camera));
  }
  return rays;
}

PairGeometry::PairGeometry(const FramePair& pair, const PairRays& rays,
                           const Parameters& parameters, const OrientationCurve& curve,
                           double velocity_change)
    : focal_(parameters.camera.fx),
      velocity_change_(velocity_change),
      seconds_(pair.b_s - pair.a_s),
      normals_(3, static_cast<Eigen::Index>(rays.a.size())) {
  const RowRotation rotation_a(pair.a_s, pair.a_excess_s, parameters, curve);
  const RowRotation rotation_b(pair.b_s, pair.b_excess_s, parameters, curve);
  const CameraModel& camera = parameters.camera;
  const auto view = [&camera](const Eigen::Matrix3d& R, const PointRay& ray, double row) {
    const double share = row / (camera.height - 1) - 0.5;
    return View{R * ray.xy.homogeneous(), R.leftCols<2>() * ray.d_pixel, share,
                share * camera.readout_s};
  };
  for (size_t i = 0; i < rays.a.size(); ++i) {
    const PointPair& point = pair.points[i];
    a_.push_back(view(rotation_a.At(point.a.y()), rays.a[i], point.a.y()));
    b_.push_back(view(rotation_b.At(point.b.y()), rays.b[i], point.b.y()));
    normals_.col(static_cast<Eigen::Index>(i)) = a_.back().ray.cross(b_.back().ray);
  }
}

Eigen::Matrix<double, 1, 3> PairGeometry::Shares(Eigen::Index point) const {
  const View& a = a_[static_cast<size_t>(point)];
  const View& b = b_[static_cast<size_t>(point)];
  return {1 + (b.row_s - a.row_s) / seconds_, -a.share, b.share};
}

Eigen::Vector3d PairGeometry::RowToRow(Eigen::Index point, const Translation& translation) const {
  return translation.reshaped(3, 3) * Shares(point).transpose();
}

double PairGeometry::Gain(Eigen::Index point, const Eigen::Vector3d& v) const {
  const View& a = a_[static_cast<size_t>(point)];
  const View& b = b_[static_cast<size_t>(point)];
  const double squared = (a.d_pixel.transpose() * b.ray.cross(v)).squaredNorm() +
                         (b.d_pixel.transpose() * v.cross(a.ray)).squaredNorm();
  return squared > 0 ? 1 / std::sqrt(squared) : 0;
}

Eigen::VectorXd PairGeometry::Residuals(const Translation& translation) const {
  Eigen::VectorXd residuals(normals_.cols());
  for (Eigen::Index i = 0; i < normals_.cols(); ++i) {
    const Eigen::Vector3d v = RowToRow(i, translation);
    residuals[i] = HasRay(i) ? Gain(i, v) * v.dot(normals_.col(i)) : kNoRay_px;
  }
  return residuals;
}

Translation PairGeometry::BestTranslation(const Eigen::VectorXd& weights,
                                          const Translation& start) const {
  using Moments = Eigen::Matrix<double, 9, 9>;
  Translation best = start;
  for (int iteration = 0; iteration < kReweightings; ++iteration) {
    Moments moments = Moments::Zero();
    moments.diagonal().tail<6>().setConstant(std::pow(kNoise_px / ChangeSigma(), 2));
    for (Eigen::Index i = 0; i < normals_.cols(); ++i) {
      if (!HasRay(i)) {
        continue;
      }
      const Eigen::Matrix3d outer = normals_.col(i) * Shares(i);
      const Translation k = outer.reshaped();
      const double gain = best.isZero() ? focal_ : Gain(i, RowToRow(i, best));
      moments += weights[i] * gain * gain * k * k.transpose();
    }
    // Eliminate a and b; then find the direction as without them.
    const Eigen::Matrix<double, 6, 3> to_change =
        -moments.bottomRightCorner<6, 6>().ldlt().solve(moments.bottomLeftCorner<6, 3>());
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
    solver.computeDirect(moments.topLeftCorner<3, 3>() +
                         moments.topRightCorner<3, 6>() * to_change);
    best.head<3>() = solver.eigenvectors().col(0);
    best.tail<6>() = to_change * best.head<3>();
  }
  return best;
}

}  // namespace pangea::calibration
