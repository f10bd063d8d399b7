#include "calibration/epipolar.h"

#include <Eigen/Eigenvalues>
#include <cmath>

#include "core/rigid3.h"

namespace pangea::calibration {
namespace {

constexpr int kReweightings = 2;

// Rotation camera to the curve's frame within one image: rows rotate at the mean rate, to second
// order (a read-out of 30 ms at 3 rad/s leaves 1e-5 rad).
class RowRotation {
 public:
  RowRotation(double image_s, const Parameters& parameters, const OrientationCurve& curve)
      : last_row_(parameters.camera.height - 1) {
    const CameraModel& camera = parameters.camera;
    const double first_s = image_s + camera.time_offset_s;
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

}  // namespace

PairRays Unprojected(const FramePair& pair, const CameraModel& camera) {
  const auto n = static_cast<Eigen::Index>(pair.points.size());
  const Eigen::Vector2d none = Eigen::Vector2d::Constant(std::nan(""));
  PairRays rays{Eigen::Matrix2Xd(2, n), Eigen::Matrix2Xd(2, n)};
  for (Eigen::Index i = 0; i < n; ++i) {
    const PointPair& point = pair.points[static_cast<size_t>(i)];
    rays.a.col(i) = camera.Unproject(point.a).value_or(none);
    rays.b.col(i) = camera.Unproject(point.b).value_or(none);
  }
  return rays;
}

PairGeometry::PairGeometry(const FramePair& pair, const PairRays& rays,
                           const Parameters& parameters, const OrientationCurve& curve)
    : focal_(parameters.camera.fx), normals_(3, rays.a.cols()) {
  const RowRotation rotation_a(pair.a_s, parameters, curve);
  const RowRotation rotation_b(pair.b_s, parameters, curve);
  const auto view = [](const Eigen::Matrix3d& R, const Eigen::Vector2d& ray) {
    return View{R * ray.homogeneous(), R.col(0), R.col(1)};
  };
  for (Eigen::Index i = 0; i < rays.a.cols(); ++i) {
    const PointPair& point = pair.points[static_cast<size_t>(i)];
    a_.push_back(view(rotation_a.At(point.a.y()), rays.a.col(i)));
    b_.push_back(view(rotation_b.At(point.b.y()), rays.b.col(i)));
    normals_.col(i) = a_.back().ray.cross(b_.back().ray);
  }
}

double PairGeometry::Gain(Eigen::Index point, const Eigen::Vector3d& direction) const {
  const auto i = static_cast<size_t>(point);
  const Eigen::Vector3d da = b_[i].ray.cross(direction), db = direction.cross(a_[i].ray);
  const double squared = std::pow(da.dot(a_[i].right), 2) + std::pow(da.dot(a_[i].down), 2) +
                         std::pow(db.dot(b_[i].right), 2) + std::pow(db.dot(b_[i].down), 2);
  return squared > 0 ? focal_ / std::sqrt(squared) : 0;
}

Eigen::VectorXd PairGeometry::Residuals(const Eigen::Vector3d& direction) const {
  Eigen::VectorXd residuals(normals_.cols());
  for (Eigen::Index i = 0; i < normals_.cols(); ++i) {
    residuals[i] = HasRay(i) ? Gain(i, direction) * direction.dot(normals_.col(i)) : kNoRay_px;
  }
  return residuals;
}

Eigen::Vector3d PairGeometry::Direction(const Eigen::VectorXd& weights,
                                        const Eigen::Vector3d& start) const {
  Eigen::Vector3d direction = start;
  for (int iteration = 0; iteration < kReweightings; ++iteration) {
    Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
    for (Eigen::Index i = 0; i < normals_.cols(); ++i) {
      if (!HasRay(i)) {
        continue;
      }
      const double gain = direction.isZero() ? focal_ : Gain(i, direction);
      moments += weights[i] * gain * gain * normals_.col(i) * normals_.col(i).transpose();
    }
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
    solver.computeDirect(moments);
    direction = solver.eigenvectors().col(0);
  }
  return direction;
}

}  // namespace pangea::calibration
