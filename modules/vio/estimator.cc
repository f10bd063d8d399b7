#include "vio/estimator.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <deque>

#include "vio/feature_updates.h"
#include "vio/initialiser.h"
#include "vio/keyframe_finisher.h"
#include "vio/track_history.h"
#include "vio/window_filter.h"

namespace pangea::vio {
namespace {

using Eigen::Vector3d;

constexpr int64_t kMaxImuGap_us = 300'000;
constexpr double kMaxFrameGap_s = 1.0;
constexpr int kMaxBlindFrames = 20;  // images in a row with next to nothing to go by: lost
constexpr int kMinUsed = 4;
constexpr double kMaxSpeed = 50;     // m/s
constexpr double kMaxGyroBias = 1;   // rad/s
constexpr double kMaxAccelBias = 4;  // m/s^2

// The image stands still when it moves less than this between images; then a new image replaces the
// one before.
constexpr double kStillPixels = 0.4;
constexpr size_t kStillTracks = 15;
// ... and the body is at rest when it has stood still this long with a quiet gyro and
// accelerometer.
constexpr int kRestFrames = 6;
constexpr double kRestVelocitySigma = 0.02;  // m/s
constexpr double kRestGyro = 0.05;           // rad/s, mean rate less bias
constexpr double kRestAccel = 0.3;           // m/s^2, standard deviation

// Prior uncertainty of the given calibration.
constexpr double kExtrinsicsRotationSigma = 0.005;  // rad
constexpr double kExtrinsicsPositionSigma = 0.005;  // m
constexpr double kTimeOffsetSigma = 0.003;          // s

double Seconds(int64_t us) { return 1e-6 * static_cast<double>(us); }

// From (dtheta, dp, dv) to right-invariant errors: xi = d - dtheta x value.
Eigen::Matrix<double, 15, 15> ToInvariant(const ImuState& imu,
                                          const Eigen::Matrix<double, 15, 15>& covariance) {
  Eigen::Matrix<double, 15, 15> J = Eigen::Matrix<double, 15, 15>::Identity();
  J.block<3, 3>(kPosition, kTheta) = Hat(imu.T_odom_body.t);
  J.block<3, 3>(kVelocity, kTheta) = Hat(imu.v_odom_body);
  return J * covariance * J.transpose();
}

}  // namespace

struct Estimator::Impl {
  Impl(const EstimatorOptions& o, const CameraModel& c, const ImuNoise& n)
      : options(o),
        camera(c),
        noise(n),
        ray_sigma(o.pixel_sigma * c.PixelAngle()),
        initialiser(c, n, o.pixel_sigma),
        updates(o.window, o.max_landmarks) {}

  FrameResult AddFrame(const TrackedFrame& frame, std::span<const ImuSample> imu);
  std::vector<FinishedKeyframe> Flush();

  void Start(const InitialState& initial);
  std::optional<std::string> Propagate(int64_t utime);
  void UpdateAtRest(int64_t previous_utime);
  void ChooseKeyframe(const TrackedFrame& frame);
  void ShrinkWindow(std::vector<FinishedKeyframe>* finished);
  void RemoveClone(int index);
  FinishedKeyframe Finish(int index);
  Matrix6d CloneCovariance(int index) const {
    const int at = filter->state().CloneOffset(index);
    return filter->state().covariance.block<6, 6>(at, at);
  }
  Preintegration IntegrateBetween(int64_t from_utime, int64_t to_utime, const ImuState& at) const;
  std::optional<std::string> Implausible() const;
  int64_t ImuTime(int64_t frame_utime) const {
    const double offset = filter ? filter->state().time_offset_s : camera.time_offset_s;
    return frame_utime + static_cast<int64_t>(std::llround(1e6 * offset));
  }
  int NewestClone() const { return static_cast<int>(filter->state().clones.size()) - 1; }

  EstimatorOptions options;
  CameraModel camera;
  ImuNoise noise;
  double ray_sigma;
  Initialiser initialiser;
  std::optional<WindowFilter> filter;
  TrackHistory history;
  FeatureUpdates updates;
  std::deque<ImuSample> imu_samples;                // since the last finished keyframe
  int64_t filter_utime = 0;                         // IMU time of the filter's state
  int64_t last_keyframe_utime = 0;                  // newest clone that is a keyframe
  std::optional<FinishedKeyframe> previous;         // the last finished keyframe
  Matrix6d previous_covariance = Matrix6d::Zero();  // of its clone, when it was finished
  Vector3d omega_body = Vector3d::Zero();
  bool still = false;
  int still_frames = 0;
  int blind_frames = 0;
  bool lost = false;
};

void Estimator::Impl::Start(const InitialState& initial) {
  WindowState state;
  state.imu = initial.imu;
  state.T_body_cam = camera.T_body_cam;
  state.time_offset_s = camera.time_offset_s;
  state.covariance = Eigen::MatrixXd::Zero(kFixedSize, kFixedSize);
  state.covariance.topLeftCorner<15, 15>() = ToInvariant(initial.imu, initial.covariance);
  Eigen::Matrix<double, 7, 1> sigma;
  sigma << Vector3d::Constant(kExtrinsicsRotationSigma),
      Vector3d::Constant(kExtrinsicsPositionSigma), kTimeOffsetSigma;
  state.covariance.bottomRightCorner<7, 7>() = sigma.cwiseAbs2().asDiagonal();
  filter.emplace(noise, std::move(state));
  filter_utime = ImuTime(initial.utime);
}

// Nothing when it worked, else what is wrong.
std::optional<std::string> Estimator::Impl::Propagate(int64_t utime) {
  const int64_t target = ImuTime(utime);
  if (target <= filter_utime) {
    return std::nullopt;
  }
  std::vector<ImuSample> span;
  for (size_t i = 0; i + 1 < imu_samples.size(); ++i) {
    const ImuSample& a = imu_samples[i];
    const ImuSample& b = imu_samples[i + 1];
    if (b.utime <= filter_utime || a.utime >= target) {
      continue;
    }
    if (b.utime - a.utime > kMaxImuGap_us) {
      return fmt::format("the inertial samples have a gap of {:.2f} s", Seconds(b.utime - a.utime));
    }
    if (span.empty()) {
      span.push_back(a.utime < filter_utime ? InterpolateImu(a, b, filter_utime) : a);
    }
    span.push_back(b.utime > target ? InterpolateImu(a, b, target) : b);
  }
  if (span.size() < 2) {
    return "no inertial samples up to the image's time";
  }
  // The time offset may want a little more than has come: the last sample holds.
  if (span.back().utime < target) {
    ImuSample held = span.back();
    held.utime = target;
    span.push_back(held);
  }
  filter->Propagate(span);
  filter_utime = target;
  omega_body = span.back().gyro - filter->state().imu.gyro_bias;
  return std::nullopt;
}

void Estimator::Impl::UpdateAtRest(int64_t previous_utime) {
  const WindowState& state = filter->state();
  const int n = static_cast<int>(state.clones.size());
  const Clone& newest = state.clones[n - 1];
  still = false;
  if (n >= 2) {
    const TrackHistory::Shift shift =
        history.ShiftBetween(previous_utime, newest.utime, Eigen::Quaterniond::Identity());
    still = shift.shared >= kStillTracks && shift.median < kStillPixels * camera.PixelAngle();
  }
  still_frames = still ? still_frames + 1 : 0;
  if (still_frames < kRestFrames) {
    return;
  }
  Vector3d mean_gyro = Vector3d::Zero(), mean_accel = Vector3d::Zero();
  std::vector<ImuSample> recent;
  for (auto it = imu_samples.rbegin(); it != imu_samples.rend() && recent.size() < 50; ++it) {
    recent.push_back(*it);
    mean_gyro += it->gyro;
    mean_accel += it->accel;
  }
  mean_gyro /= static_cast<double>(recent.size());
  mean_accel /= static_cast<double>(recent.size());
  double var_accel = 0;
  for (const ImuSample& sample : recent) {
    var_accel += (sample.accel - mean_accel).squaredNorm() / static_cast<double>(recent.size());
  }
  if ((mean_gyro - state.imu.gyro_bias).norm() > kRestGyro || var_accel > kRestAccel * kRestAccel) {
    return;
  }
  Measurement m;
  m.H = Eigen::MatrixXd::Zero(3, state.size());
  m.H.block<3, 3>(0, kTheta) = -Hat(state.imu.v_odom_body);
  m.H.block<3, 3>(0, kVelocity).setIdentity();
  m.r = -state.imu.v_odom_body;
  filter->Update(m, kRestVelocitySigma);
}

void Estimator::Impl::ChooseKeyframe(const TrackedFrame& frame) {
  WindowState& state = filter->mutable_state();
  Clone& newest = state.clones.back();
  const int last = state.CloneIndex(last_keyframe_utime);
  const double elapsed = Seconds(frame.utime - last_keyframe_utime);
  bool wanted = last_keyframe_utime == 0 || elapsed >= options.keyframe_interval_s;
  if (!wanted && elapsed >= options.keyframe_min_interval_s) {
    // Without the last keyframe in the window there is nothing left in common to measure.
    wanted = last < 0 || state.clones[last].is_edge_end;
    if (!wanted) {
      const Eigen::Quaterniond q_newest_last =
          (newest.T_odom_body.q * state.T_body_cam.q).conjugate() *
          (state.clones[last].T_odom_body.q * state.T_body_cam.q);
      const TrackHistory::Shift shift =
          history.ShiftBetween(last_keyframe_utime, frame.utime, q_newest_last);
      const double share = static_cast<double>(shift.shared) /
                           std::max<double>(1.0, history.Frame(last_keyframe_utime).size());
      wanted = shift.median > options.keyframe_parallax_px * camera.PixelAngle() ||
               share < options.keyframe_track_share;
    }
  }
  if (wanted) {
    newest.is_keyframe = true;
    last_keyframe_utime = frame.utime;
  }
}

Preintegration Estimator::Impl::IntegrateBetween(int64_t from_utime, int64_t to_utime,
                                                 const ImuState& at) const {
  Preintegrator integrator(noise, at.gyro_bias, at.accel_bias);
  const int64_t from = ImuTime(from_utime), to = ImuTime(to_utime);
  for (size_t i = 0; i + 1 < imu_samples.size(); ++i) {
    ImuSample a = imu_samples[i], b = imu_samples[i + 1];
    if (b.utime <= from || a.utime >= to) {
      continue;
    }
    const ImuSample begin = a.utime < from ? InterpolateImu(a, b, from) : a;
    const ImuSample end = b.utime > to ? InterpolateImu(a, b, to) : b;
    integrator.Add(begin, end);
  }
  return integrator.result();
}

FinishedKeyframe Estimator::Impl::Finish(int index) {
  WindowState& state = filter->mutable_state();
  FinishedKeyframe keyframe = FinishKeyframe(state, history, index);
  int edge_end = -1;
  for (int i = 0; i < static_cast<int>(state.clones.size()); ++i) {
    edge_end = state.clones[i].is_edge_end ? i : edge_end;
  }
  if (previous && edge_end >= 0) {
    keyframe.edge = FinishedKeyframe::Edge{previous->T_odom_body.Inverse() * keyframe.T_odom_body,
                                           RelativeCovariance(state, edge_end, index)};
    keyframe.edge->covariance +=
        CorrectionCovariance(previous_covariance - CloneCovariance(edge_end), previous->T_odom_body,
                             keyframe.T_odom_body);
    ImuState at;
    at.gyro_bias = previous->gyro_bias;
    at.accel_bias = previous->accel_bias;
    Preintegration span = IntegrateBetween(previous->utime, keyframe.utime, at);
    if (span.duration_s > 0) {
      span.covariance.diagonal().array() += 1e-14;
      keyframe.preintegration = span;
    }
  }
  previous = keyframe;
  previous_covariance = CloneCovariance(index);
  while (imu_samples.size() > 2 && imu_samples[1].utime < ImuTime(keyframe.utime) - 100'000) {
    imu_samples.pop_front();
  }
  return keyframe;
}

void Estimator::Impl::RemoveClone(int index) {
  updates.MoveAnchors(*filter, index);
  history.RemoveFrame(filter->state().clones[index].utime);
  filter->RemoveClone(index);
}

void Estimator::Impl::ShrinkWindow(std::vector<FinishedKeyframe>* finished) {
  const auto first_of_window = [&] {
    return !filter->state().clones.empty() && filter->state().clones.front().is_edge_end ? 1 : 0;
  };
  while (NewestClone() + 1 - first_of_window() > options.window) {
    const std::vector<Clone>& clones = filter->state().clones;
    const int second_newest = NewestClone() - 1;
    const int oldest = first_of_window();
    const bool oldest_is_due =
        Seconds(clones.back().utime - clones[oldest].utime) > options.keyframe_interval_s;
    if (still && !clones[second_newest].is_keyframe && !oldest_is_due) {
      RemoveClone(second_newest);
      continue;
    }
    if (clones[oldest].is_keyframe) {
      finished->push_back(Finish(oldest));
      if (oldest > 0) {
        RemoveClone(0);
      }
      // It stays until the next keyframe's edge is known, but what it saw has been used.
      updates.MoveAnchors(*filter, 0);
      history.RemoveFrame(filter->state().clones[0].utime);
      filter->mutable_state().clones[0].is_edge_end = true;
    } else {
      RemoveClone(oldest);
    }
  }
  updates.Forget(history, filter->state());
}

std::optional<std::string> Estimator::Impl::Implausible() const {
  const ImuState& imu = filter->state().imu;
  if (!filter->state().covariance.allFinite() || !imu.T_odom_body.t.allFinite()) {
    return "the estimate is not finite";
  }
  if (imu.v_odom_body.norm() > kMaxSpeed) {
    return "the estimated speed is implausible";
  }
  if (imu.gyro_bias.norm() > kMaxGyroBias || imu.accel_bias.norm() > kMaxAccelBias) {
    return "the estimated biases are implausible";
  }
  if (blind_frames > kMaxBlindFrames) {
    return fmt::format("nothing trackable in {} images", blind_frames);
  }
  return std::nullopt;
}

FrameResult Estimator::Impl::AddFrame(const TrackedFrame& frame, std::span<const ImuSample> imu) {
  FrameResult result;
  imu_samples.insert(imu_samples.end(), imu.begin(), imu.end());
  const auto fail = [&](const std::string& reason) {
    lost = true;
    result.state = EstimatorState::kLost;
    result.reason = reason;
    return result;
  };
  if (lost) {
    return fail("lost before");
  }
  if (!filter) {
    while (imu_samples.size() > 2 && Seconds(frame.utime - imu_samples[1].utime) > 1.0) {
      imu_samples.pop_front();
    }
    TrackedFrame shifted = frame;  // the initialiser works on the IMU's clock
    shifted.utime = ImuTime(frame.utime);
    const InitialResult initial = initialiser.AddFrame(shifted, imu);
    if (!initial.state) {
      result.reason = initial.reason;
      return result;
    }
    InitialState state = *initial.state;
    state.utime = frame.utime;
    Start(state);
    result.is_keyframe = false;
  } else {
    const WindowState& state = filter->state();
    if (!state.clones.empty() &&
        Seconds(frame.utime - state.clones.back().utime) > kMaxFrameGap_s) {
      return fail(
          fmt::format("no images for {:.1f} s", Seconds(frame.utime - state.clones.back().utime)));
    }
    if (const auto wrong = Propagate(frame.utime)) {
      return fail(*wrong);
    }
  }
  const int64_t previous_utime =
      filter->state().clones.empty() ? 0 : filter->state().clones.back().utime;
  filter->AddClone(frame.utime, omega_body);
  history.AddFrame(frame, ray_sigma);
  UpdateAtRest(previous_utime);
  const FeatureUpdates::Outcome outcome = updates.Apply(*filter, history);
  const bool seeing = outcome.used >= kMinUsed || still ||
                      frame.observations.size() > 3 * static_cast<size_t>(kMinUsed);
  blind_frames = seeing ? 0 : blind_frames + 1;
  ChooseKeyframe(frame);
  ShrinkWindow(&result.finished);
  if (const auto wrong = Implausible()) {
    return fail(*wrong);
  }
  const WindowState& state = filter->state();
  result.state = EstimatorState::kTracking;
  result.T_odom_body = state.imu.T_odom_body;
  result.v_odom_body = state.imu.v_odom_body;
  result.gyro_bias = state.imu.gyro_bias;
  result.accel_bias = state.imu.accel_bias;
  result.is_keyframe = state.clones.back().is_keyframe;
  result.outlier_landmarks = outcome.outliers;
  return result;
}

std::vector<FinishedKeyframe> Estimator::Impl::Flush() {
  std::vector<FinishedKeyframe> finished;
  if (!filter) {
    return finished;
  }
  for (bool any = true; any;) {
    any = false;
    for (int i = 0; i <= NewestClone(); ++i) {
      if (filter->state().clones[i].is_keyframe && !filter->state().clones[i].is_edge_end) {
        finished.push_back(Finish(i));
        for (Clone& clone : filter->mutable_state().clones) {
          clone.is_edge_end = false;
          clone.is_keyframe = clone.is_keyframe && clone.utime > finished.back().utime;
        }
        filter->mutable_state().clones[i].is_edge_end = true;
        any = true;
        break;
      }
    }
  }
  return finished;
}

Estimator::Estimator(const EstimatorOptions& options, const CameraModel& camera,
                     const ImuNoise& noise)
    : impl_(std::make_unique<Impl>(options, camera, noise)) {}
Estimator::~Estimator() = default;
Estimator::Estimator(Estimator&&) noexcept = default;
Estimator& Estimator::operator=(Estimator&&) noexcept = default;

FrameResult Estimator::AddFrame(const TrackedFrame& frame, std::span<const ImuSample> imu) {
  return impl_->AddFrame(frame, imu);
}

std::vector<FinishedKeyframe> Estimator::Flush() { return impl_->Flush(); }

CameraModel Estimator::camera() const {
  CameraModel camera = impl_->camera;
  if (impl_->filter) {
    camera.T_body_cam = impl_->filter->state().T_body_cam;
    camera.time_offset_s = impl_->filter->state().time_offset_s;
  }
  return camera;
}

}  // namespace pangea::vio
