#include "vio/vio.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <utility>

#include "core/rigid3.h"
#include "vio/live/rolling_shutter.h"

namespace pangea::vio {
namespace {

constexpr size_t kMaxPoints = 150;  // map points of a keyframe: the most certain ones

// Largest error of the gyroscope's bias, rad/s: before the start, and while tracking.
constexpr double kUnknownBias = 0.15;
constexpr double kKnownBias = 0.02;
constexpr double kMiddleRow = 0.5;

// The time of the image's middle row.
int64_t CalibratedImuTime(const CameraModel& camera, int64_t image_utime) {
  return image_utime + std::llround(1e6 * (camera.time_offset_s + kMiddleRow * camera.readout_s));
}

}  // namespace

Vio::Vio(int32_t agent_id, const CameraModel& camera, const ImuNoise& noise,
         const VioOptions& options, OpenMap open_map)
    : agent_id_(agent_id),
      camera_(camera),
      noise_(noise),
      options_(options),
      open_map_(std::move(open_map)),
      tracker_(camera, options.tracker),
      repeated_images_(camera),
      repeat_stamps_(camera),
      describer_(camera, options.describer) {
  if (options.tags) {
    tag_detector_.emplace();
  }
  OpenNewMap();
}

void Vio::OpenNewMap() {
  // A map without a pose keeps its id.
  if (maps_opened_ == 0 || map_has_poses_) {
    map_ = {agent_id_, open_map_()};
    ++maps_opened_;
  }
  map_has_poses_ = false;
  in_doubt_ = false;
  next_seq_ = 0;
  group_revision_ = 0;
  scale_sigma_.reset();
  described_.clear();
  tracker_.Reset();
  repeated_images_.Reset();
  repeat_stamps_.EndTracks();
  waiting_imu_.clear();
  held_.reset();
  estimator_.emplace(options_.estimator, camera_, noise_);
}

int64_t Vio::ImuTimeOf(int64_t image_utime) const { return ImuTimeOfRow(image_utime, 1); }

int64_t Vio::ImuTimeOfRow(int64_t image_utime, double row) const {
  // Not less than the calibrated offset, so that the requested times increase while the estimated
  // offset changes.
  const double offset_s = std::max(camera_.time_offset_s, estimator_->camera().time_offset_s);
  return image_utime + std::llround(1e6 * (offset_s + row * camera_.readout_s));
}

// The camera's rotation between two times: maps directions at the first to the second.
Eigen::Quaterniond Vio::CameraRotation(int64_t from_imu_utime, int64_t to_imu_utime,
                                       const Eigen::Vector3d& gyro_bias) const {
  const Eigen::Quaterniond q_from_to =
      gyro_rotation_.Between(from_imu_utime, to_imu_utime, gyro_bias);
  const Eigen::Quaterniond& q_body_cam = camera_.T_body_cam.q;
  return (q_body_cam.conjugate() * q_from_to.conjugate() * q_body_cam).normalized();
}

// From the last new image's middle row to this one's.
Eigen::Quaterniond Vio::RotationSinceNew(int64_t utime) const {
  return last_utime_ ? CameraRotation(ImuTimeOfRow(*last_utime_, kMiddleRow),
                                      ImuTimeOfRow(utime, kMiddleRow), gyro_bias_)
                     : Eigen::Quaterniond::Identity();
}

// With the calibrated time offset and without a bias, so that all results are comparable.
Eigen::Quaterniond Vio::CalibratedRotation(int64_t from_utime, int64_t to_utime) const {
  return CameraRotation(CalibratedImuTime(camera_, from_utime),
                        CalibratedImuTime(camera_, to_utime), Eigen::Vector3d::Zero());
}

bool Vio::Repeats(int64_t utime, const cv::Mat& image) const {
  if (!last_utime_) {
    return false;
  }
  const double bias = map_has_poses_ ? kKnownBias : kUnknownBias;
  return repeated_images_.IsRepeat(utime, image, RotationSinceNew(utime),
                                   1e-6 * bias * static_cast<double>(utime - *last_utime_));
}

VioOutput Vio::AddImage(int64_t utime, const cv::Mat& image, std::span<const ImuSample> imu) {
  gyro_rotation_.Add(imu);
  waiting_imu_.insert(waiting_imu_.end(), imu.begin(), imu.end());
  return Repeats(utime, image) ? AddRepeat(utime) : AddNewImage(utime, image);
}

VioOutput Vio::AddRepeat(int64_t utime) {
  repeat_stamps_.AddRepeat(utime);
  if (held_) {
    held_->frame.utime = *last_utime_ = utime;
  }
  VioOutput output;
  output.utime = utime;
  output.map = map_;
  output.repeats = true;
  return output;
}

VioOutput Vio::AddNewImage(int64_t utime, const cv::Mat& image) {
  const TrackedFrame& frame = tracker_.Track(
      utime, image, in_doubt_ ? std::nullopt : std::optional(RotationSinceNew(utime)));
  repeated_images_.NoteNew(image, frame);
  repeat_stamps_.AddNew(frame, std::bind_front(&Vio::CalibratedRotation, this));
  gyro_rotation_.ForgetUntil(
      CalibratedImuTime(camera_, repeat_stamps_.oldest_utime().value_or(utime)));
  last_utime_ = utime;
  if (repeat_stamps_.last_is_right() != last_stamp_is_right_) {
    return ChangeStamps();
  }
  return last_stamp_is_right_ ? Hold(frame, image)
                              : Estimate(frame, image, std::exchange(waiting_imu_, {}));
}

// With other stamps the odometry starts anew, which is seldom later than its first start.
VioOutput Vio::ChangeStamps() {
  VioOutput output;
  output.utime = *last_utime_;
  output.map = map_;
  output.reason = "images repeat, and the last stamp of each is the right one";
  output.keyframes = StartAnew();
  last_stamp_is_right_ = repeat_stamps_.last_is_right();
  return output;
}

// Keeps the image until the next one, and estimates with the one before.
VioOutput Vio::Hold(const TrackedFrame& frame, const cv::Mat& image) {
  const auto ready = std::exchange(held_, HeldImage{frame, image.clone()});
  if (ready) {
    return Estimate(ready->frame, ready->image, TakeImuUntil(ready->frame.utime));
  }
  VioOutput output;
  output.utime = frame.utime;
  output.map = map_;
  output.reason = "the image may come again";
  return output;
}

// The waiting samples up to and including the first one at or after the image.
std::vector<ImuSample> Vio::TakeImuUntil(int64_t image_utime) {
  const int64_t end = ImuTimeOf(image_utime);
  auto it = std::find_if(waiting_imu_.begin(), waiting_imu_.end(),
                         [end](const ImuSample& sample) { return sample.utime >= end; });
  it = it == waiting_imu_.end() ? it : std::next(it);
  std::vector<ImuSample> taken(waiting_imu_.begin(), it);
  waiting_imu_.erase(waiting_imu_.begin(), it);
  return taken;
}
VioOutput Vio::AddTracks(const TrackedFrame& frame, const cv::Mat& image,
                         std::span<const ImuSample> imu) {
  return Estimate(frame, image, imu);
}

// Before there is a pose, gravity is taken from the accelerometer: it measures upwards.
Eigen::Vector3d Vio::DownInCamera(const FrameResult& result, std::span<const ImuSample> imu) const {
  Eigen::Vector3d down_body = Eigen::Vector3d::Zero();
  if (result.state == EstimatorState::kTracking) {
    down_body = result.T_odom_body.q.conjugate() * -Eigen::Vector3d::UnitZ();
  } else {
    for (const ImuSample& sample : imu) {
      down_body -= sample.accel;
    }
  }
  return camera_.T_body_cam.q.conjugate() * down_body;
}

VioOutput Vio::Estimate(const TrackedFrame& frame, const cv::Mat& image,
                        std::span<const ImuSample> imu) {
  FrameResult result = estimator_->AddFrame(frame, imu);
  VioOutput output;
  output.utime = frame.utime;
  output.state = result.state;
  output.reason = result.reason;
  output.suspect = result.suspect;
  in_doubt_ = result.in_doubt;
  output.map = map_;
  output.T_odom_body = result.T_odom_body;
  output.v_odom_body = result.v_odom_body;
  output.motion = result.motion;
  output.is_keyframe = result.is_keyframe;
  output.stationary = result.stationary;
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
    described_[frame.utime] = {
        describer_.Describe(image, frame, DownInCamera(result, imu)),
        tag_detector_ ? tag_detector_->Detect(image) : std::vector<TagObservation>()};
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
  keyframe.corners = described_.at(output.utime).corners;
  CompensateRollingShutter(output.motion, keyframe);
  return {keyframe.camera, std::move(keyframe.corners), describer_.kind(), estimator_->Poses()};
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
  gyro_rotation_.Clear();
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
  keyframe.descriptor_kind = describer_.kind();
  if (auto node = described_.extract(finished.utime)) {
    keyframe.corners = std::move(node.mapped().corners);
    keyframe.tags = std::move(node.mapped().tags);
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
