#include "vio/vio.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/rigid3.h"
#include "vio/live/rolling_shutter.h"

namespace pangea::vio {
namespace {

constexpr size_t kMaxPoints = 150;  // map points of a keyframe: the most certain ones

}  // namespace

Vio::Vio(int32_t agent_id, const CameraModel& camera, const ImuNoise& noise,
         const VioOptions& options, OpenMap open_map)
    : agent_id_(agent_id),
      camera_(camera),
      noise_(noise),
      options_(options),
      open_map_(std::move(open_map)),
      tracker_(camera, options.tracker),
      describer_(camera, options.describer) {
  OpenNewMap();
}

void Vio::OpenNewMap() {
  // A map without a pose keeps its id.
  if (maps_opened_ == 0 || map_has_poses_) {
    map_ = {agent_id_, open_map_()};
    ++maps_opened_;
  }
  map_has_poses_ = false;
  next_seq_ = 0;
  group_revision_ = 0;
  scale_sigma_.reset();
  described_.clear();
  tracker_.Reset();
  estimator_.emplace(options_.estimator, camera_, noise_);
}

int64_t Vio::ImuTimeOf(int64_t image_utime) const { return ImuTimeOfRow(image_utime, 1); }

int64_t Vio::ImuTimeOfRow(int64_t image_utime, double row) const {
  // Not less than the calibrated offset, so that the requested times increase while the estimated
  // offset changes.
  const double offset_s = std::max(camera_.time_offset_s, estimator_->camera().time_offset_s);
  return image_utime + std::llround(1e6 * (offset_s + row * camera_.readout_s));
}

// The gyroscope's rotation between the last image's middle row and this one's, as a rotation of the
// camera.
Eigen::Quaterniond Vio::CameraRotation(int64_t utime) {
  Eigen::Quaterniond q_last_now = Eigen::Quaterniond::Identity();
  constexpr double kMiddleRow = 0.5;
  const int64_t end = ImuTimeOfRow(utime, kMiddleRow);
  if (last_utime_) {
    int64_t at = ImuTimeOfRow(*last_utime_, kMiddleRow);
    for (const ImuSample& sample : rotation_imu_) {
      const int64_t until = std::min(sample.utime, end);
      if (until > at) {
        const double dt = 1e-6 * static_cast<double>(until - at);
        q_last_now = q_last_now * ExpSo3((sample.gyro - gyro_bias_) * dt);
        at = until;
      }
    }
  }
  std::erase_if(rotation_imu_, [end](const ImuSample& sample) { return sample.utime <= end; });
  last_utime_ = utime;
  const Eigen::Quaterniond& q_body_cam = camera_.T_body_cam.q;
  return (q_body_cam.conjugate() * q_last_now.conjugate() * q_body_cam).normalized();
}

VioOutput Vio::AddImage(int64_t utime, const cv::Mat& image, std::span<const ImuSample> imu) {
  rotation_imu_.insert(rotation_imu_.end(), imu.begin(), imu.end());
  return Estimate(tracker_.Track(utime, image, CameraRotation(utime)), image, imu);
}

VioOutput Vio::AddTracks(const TrackedFrame& frame, const cv::Mat& image,
                         std::span<const ImuSample> imu) {
  return Estimate(frame, image, imu);
}

VioOutput Vio::Estimate(const TrackedFrame& frame, const cv::Mat& image,
                        std::span<const ImuSample> imu) {
  FrameResult result = estimator_->AddFrame(frame, imu);
  VioOutput output;
  output.utime = frame.utime;
  output.state = result.state;
  output.reason = result.reason;
  output.map = map_;
  output.T_odom_body = result.T_odom_body;
  output.v_odom_body = result.v_odom_body;
  output.motion = result.motion;
  output.is_keyframe = result.is_keyframe;
  output.imu_contradicted = result.imu_contradicted;
  output.num_tracked = static_cast<int>(frame.observations.size());
  for (const FinishedKeyframe& finished : result.finished) {
    scale_sigma_ = finished.scale_sigma ? finished.scale_sigma : scale_sigma_;
  }
  output.scale_sigma = scale_sigma_;
  output.keyframes = Complete(result.finished);
  if (result.state == EstimatorState::kLost) {
    OpenNewMap();
    return output;
  }
  if (result.is_keyframe) {
    described_[frame.utime] = describer_.Describe(image, frame);
  }
  if (result.state == EstimatorState::kTracking) {
    map_has_poses_ = true;
    gyro_bias_ = result.gyro_bias;
  }
  tracker_.Drop(result.outlier_landmarks);
  return output;
}

Vio::View Vio::NewestKeyframe(const VioOutput& output) const {
  Keyframe keyframe;
  keyframe.camera = estimator_->camera();
  keyframe.corners = described_.at(output.utime);
  CompensateRollingShutter(output.motion, keyframe);
  return {keyframe.camera, std::move(keyframe.corners), estimator_->Poses()};
}

void Vio::NoteCorrection(const MapId& map, int64_t revision) {
  if (map == map_) {
    group_revision_ = revision;
  }
}

std::vector<Keyframe> Vio::Flush() { return Complete(estimator_->Flush()); }

std::vector<Keyframe> Vio::StartAnew() {
  std::vector<Keyframe> keyframes = Flush();
  OpenNewMap();
  rotation_imu_.clear();
  last_utime_.reset();
  return keyframes;
}

std::vector<Keyframe> Vio::Complete(const std::vector<FinishedKeyframe>& finished) {
  std::vector<Keyframe> keyframes;
  for (const FinishedKeyframe& one : finished) {
    keyframes.push_back(Complete(one));
  }
  return keyframes;
}

Keyframe Vio::Complete(const FinishedKeyframe& finished) {
  Keyframe keyframe;
  keyframe.id = {map_, next_seq_++};
  keyframe.utime = finished.utime;
  keyframe.camera = estimator_->camera();
  keyframe.T_odom_body = finished.T_odom_body;
  keyframe.v_odom_body = finished.v_odom_body;
  keyframe.gyro_bias = finished.gyro_bias;
  keyframe.accel_bias = finished.accel_bias;
  keyframe.roll_pitch_covariance = finished.roll_pitch_covariance;
  if (finished.edge) {
    keyframe.edge = OdometryEdge{keyframe.id.seq - 1, finished.edge->T_previous_this,
                                 finished.edge->covariance};
  }
  keyframe.preintegration = finished.preintegration;
  if (auto node = described_.extract(finished.utime)) {
    keyframe.corners = std::move(node.mapped());
  }
  keyframe.points = Points(finished, keyframe.corners);
  CompensateRollingShutter(finished.motion, keyframe);
  keyframe.group_revision = group_revision_;
  keyframe.scale_sigma =
      std::min(finished.scale_sigma.value_or(scale_sigma_.value_or(0)), kMaxScaleSigma);
  keyframe.T_body_cam_covariance = finished.T_body_cam_covariance;
  return keyframe;
}

std::vector<MapPoint> Vio::Points(const FinishedKeyframe& finished,
                                  const std::vector<Corner>& corners) const {
  std::map<int32_t, int> corner_of;
  for (size_t i = 0; i < corners.size(); ++i) {
    if (corners[i].landmark_id != kNoLandmark) {
      corner_of[corners[i].landmark_id] = static_cast<int>(i);
    }
  }
  std::vector<MapPoint> points;
  for (const LandmarkDepth& landmark : finished.landmarks) {
    const auto corner = corner_of.find(landmark.landmark_id);
    const auto depth = static_cast<float>(landmark.inverse_depth);
    const auto variance = static_cast<float>(landmark.inverse_depth_var);
    if (corner != corner_of.end() && depth > 0 && variance > 0 && std::isfinite(depth) &&
        std::isfinite(variance)) {
      points.push_back({corner->second, depth, variance});
    }
  }
  // Sort by relative uncertainty: a point at 10 m with sigma 10 cm is as good as one at 1 m with 1
  // cm.
  std::stable_sort(points.begin(), points.end(), [](const MapPoint& a, const MapPoint& b) {
    return a.inverse_depth_var * b.inverse_depth * b.inverse_depth <
           b.inverse_depth_var * a.inverse_depth * a.inverse_depth;
  });
  points.resize(std::min(points.size(), kMaxPoints));
  return points;
}

}  // namespace pangea::vio
