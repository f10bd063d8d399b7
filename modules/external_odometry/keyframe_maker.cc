#include "external_odometry/keyframe_maker.h"

#include <cmath>

namespace pangea {
namespace {

constexpr size_t kMaxObservations = 60;
constexpr double kMinInverseDepth = 0.01;  // 1/m
constexpr double kRotationError = 0.02;    // largest, of the odometry's rotation rate, rad/s

}  // namespace

KeyframeMaker::KeyframeMaker(const MapId& map, const CameraModel& camera,
                             const KeyframeMakerOptions& options)
    : options_(options),
      camera_(camera),
      tracker_(camera, vio::TrackerOptions{}),
      repeated_images_(camera),
      describer_(camera, vio::DescriberOptions{}),
      next_{map, 0} {}

std::optional<Keyframe> KeyframeMaker::Add(int64_t utime, const cv::Mat& image,
                                           const Rigid3& T_odom_body) {
  const Step now{utime, T_odom_body};
  const Rigid3 T_odom_cam = T_odom_body * camera_.T_body_cam;
  const Eigen::Quaterniond q_cam_lastcam =
      last_ ? T_odom_cam.q.conjugate() * (last_->T_odom_body * camera_.T_body_cam).q
            : Eigen::Quaterniond::Identity();
  if (last_ && repeated_images_.IsRepeat(
                   utime, image, q_cam_lastcam,
                   kRotationError * 1e-6 * static_cast<double>(utime - last_->utime))) {
    return std::nullopt;
  }
  const vio::TrackedFrame& frame = tracker_.Track(utime, image, q_cam_lastcam);
  repeated_images_.NoteNew(image, frame);
  std::map<int32_t, std::deque<Observation>> seen;  // drops the tracks that ended
  for (const vio::Observation& observation : frame.observations) {
    auto& observations = seen[observation.landmark_id];
    if (const auto known = observations_.find(observation.landmark_id);
        known != observations_.end()) {
      observations = std::move(known->second);
    }
    observations.push_back({T_odom_cam, observation.ray});
    if (observations.size() > kMaxObservations) {
      observations.pop_front();
    }
  }
  observations_ = std::move(seen);
  std::optional<Keyframe> keyframe;
  if (IsDue(now)) {
    keyframe = Make(image, frame, now);
    last_keyframe_ = now;
    ++next_.seq;
  }
  last_ = now;
  return keyframe;
}

bool KeyframeMaker::IsDue(const Step& now) const {
  if (!last_keyframe_) {
    return last_.has_value();  // the first keyframe needs a velocity and tracks
  }
  const Rigid3 step = last_keyframe_->T_odom_body.Inverse() * now.T_odom_body;
  return step.t.norm() > options_.keyframe_distance_m ||
         LogSo3(step.q).norm() > options_.keyframe_angle ||
         1e-6 * static_cast<double>(now.utime - last_keyframe_->utime) >
             options_.keyframe_interval_s;
}

Keyframe KeyframeMaker::Make(const cv::Mat& image, const vio::TrackedFrame& frame,
                             const Step& now) {
  Keyframe keyframe;
  keyframe.id = next_;
  keyframe.utime = now.utime;
  keyframe.camera = camera_;
  keyframe.T_odom_body = now.T_odom_body;
  keyframe.v_odom_body = (now.T_odom_body.t - last_->T_odom_body.t) /
                         (1e-6 * static_cast<double>(now.utime - last_->utime));
  keyframe.roll_pitch_covariance =
      Eigen::Matrix2d::Identity() * options_.tilt_sigma * options_.tilt_sigma;
  if (last_keyframe_) {
    // If your odometry estimates a covariance, use that instead.
    const Eigen::Matrix3d R_from_odom = last_keyframe_->T_odom_body.R().transpose();
    const Eigen::Vector3d sigmas_odom(options_.tilt_sigma, options_.tilt_sigma,
                                      options_.edge_sigma_yaw);
    OdometryEdge edge;
    edge.from_seq = next_.seq - 1;
    edge.T_from_this = last_keyframe_->T_odom_body.Inverse() * now.T_odom_body;
    edge.covariance.setZero();
    edge.covariance.topLeftCorner<3, 3>() =
        Eigen::Matrix3d::Identity() * options_.edge_sigma_m * options_.edge_sigma_m;
    edge.covariance.bottomRightCorner<3, 3>() =
        R_from_odom * sigmas_odom.cwiseAbs2().asDiagonal() * R_from_odom.transpose();
    keyframe.edge = edge;
  }
  keyframe.descriptor_kind = describer_.kind();
  keyframe.corners = describer_.Describe(
      image, frame, -(keyframe.T_odom_cam().q.conjugate() * Eigen::Vector3d::UnitZ()));
  for (size_t i = 0; i < keyframe.corners.size(); ++i) {
    const auto point = Triangulate(static_cast<int>(i), keyframe.corners[i], keyframe.T_odom_cam());
    if (point) {
      keyframe.points.push_back(*point);
    }
  }
  return keyframe;
}

// Triangulates by Gauss-Newton in the inverse depth along the newest ray, with all earlier
// observations.
std::optional<MapPoint> KeyframeMaker::Triangulate(int corner, const Corner& of,
                                                   const Rigid3& T_odom_cam) const {
  const auto found = observations_.find(of.landmark_id);
  if (of.landmark_id == kNoLandmark || found == observations_.end() || found->second.size() < 3) {
    return std::nullopt;
  }
  const std::deque<Observation>& observations = found->second;
  const Eigen::Vector3d ray = observations.back().ray.homogeneous();
  const double sigma = options_.triangulation_px * camera_.PixelAngle();
  double inverse_depth = 0.2, information = 0, error = 0;
  constexpr int kIterations = 8;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    double gradient = 0;
    information = error = 0;
    for (size_t i = 0; i + 1 < observations.size(); ++i) {
      const Rigid3 T = observations[i].T_odom_cam.Inverse() * T_odom_cam;
      const Eigen::Vector3d p = T.q * ray + inverse_depth * T.t;  // up to scale
      if (p.z() < 1e-3) {
        return std::nullopt;
      }
      const Eigen::Vector2d r = p.head<2>() / p.z() - observations[i].ray;
      const Eigen::Vector2d J = (T.t.head<2>() - p.head<2>() / p.z() * T.t.z()) / p.z();
      gradient += J.dot(r) / (sigma * sigma);
      information += J.squaredNorm() / (sigma * sigma);
      error += r.squaredNorm() / (sigma * sigma);
    }
    if (information <= 0) {
      return std::nullopt;
    }
    inverse_depth = std::max(kMinInverseDepth, inverse_depth - gradient / information);
  }
  // chi-squared, 2 dimensions: beyond it the point is not static
  constexpr double kMaxMeanError = 4;
  const double deviation = 1 / std::sqrt(information);
  if (error / static_cast<double>(observations.size() - 1) > kMaxMeanError ||
      deviation > options_.max_relative_sigma * inverse_depth) {
    return std::nullopt;
  }
  return MapPoint{corner, static_cast<float>(inverse_depth),
                  static_cast<float>(deviation * deviation)};
}

}  // namespace pangea
