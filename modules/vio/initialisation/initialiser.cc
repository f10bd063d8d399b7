#include "vio/initialisation/initialiser.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/imu/preintegration.h"
#include "vio/imu/imu_buffer.h"
#include "vio/imu/imu_noise.h"
#include "vio/initialisation/calibration_faults.h"
#include "vio/initialisation/initial_solution.h"

namespace pangea::vio {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kFrameSpacing_s = 0.09;  // images used for a moving start
constexpr double kMinSpan_s = 1.0;        // shortest start-up window
constexpr double kMaxSpan_s = 3.0;        // longest start-up window: older images are forgotten
constexpr double kSampleMargin_s = 0.1;   // of samples before the oldest image
constexpr size_t kMinTracks = 20;

// The mean acceleration over a second or more is about gravity, however the device is moved. Far
// less means a dead sensor or units of g; far more means other units.
constexpr double kMinMeanAccel = 4;   // m/s^2
constexpr double kMaxMeanAccel = 25;  // m/s^2
// About one rotation per second, at which no image is sharp; a sensor in degrees/s shows more.
constexpr double kMaxMeanGyro = 6;  // rad/s

// Stationary: the image does not move, accelerometer and gyro are quiet. Or they are shaken about
// means that stay, and in no image of the span do most tracks move.
constexpr double kStationarySpan_s = 1.0;
// Limits as shares of the options: a whole second is tested, so they are tighter than later.
constexpr double kStationaryAccel = 5.0 / 6;  // standard deviation, of accel_sigma
constexpr double kStationaryGyro = 0.6;       // standard deviation, of gyro_rate
// A stationary start assumes a smaller bias than a moving one; a larger one would tilt it.
constexpr double kStationaryBias = 0.1 / 0.15;  // of accel_bias_sigma
constexpr double kMinGyroBiasSigma = 0.002;     // rad/s; a shaken mean is known less well

// Requirements on the result of a moving start.
constexpr double kMaxVelocitySigma = 0.05;  // m/s, or
constexpr double kMaxSpeedShare = 0.03;     // of the speed: 0.05 m/s at a typical flight's 1.7 m/s
constexpr double kMaxTiltSigma = 0.035;     // rad
constexpr double kMaxRmsSigmas = 1.8;
constexpr double kMaxAccelBias = 0.8 / 0.15;  // of accel_bias_sigma

// With a larger gyro bias than most phones have, the start is also refined from a bias of zero. A
// second of a plane seen at few angles has another minimum, several degrees per second away.
constexpr double kUsualGyroBias = 0.02;  // rad/s

// Attempts without success after which the calibration is doubted. With a wrong one each attempt
// takes long, so there are fewer of them from then on. After kSearching of them usual mistakes are
// looked for, and again each time that so many more have failed.
constexpr int kDoubtful = 5;
constexpr int kSearching = 8;
constexpr double kDoubtfulInterval_s = 0.8;
constexpr double kCheckInterval_s = 5;  // of the focal length, after the start

// Of the tracks that both frames have, in ascending order.
std::vector<double> Displacements(const TrackedFrame& a, const TrackedFrame& b) {
  std::vector<double> displacement;
  for (const Observation& first : a.observations) {
    for (const Observation& second : b.observations) {
      if (first.landmark_id == second.landmark_id) {
        displacement.push_back((first.pixel - second.pixel).norm());
      }
    }
  }
  std::sort(displacement.begin(), displacement.end());
  return displacement;
}

bool DisplacedLessThan(double limit, double share, const std::vector<double>& displacements) {
  const auto at = static_cast<size_t>(share * static_cast<double>(displacements.size()));
  return displacements.size() >= kMinTracks && displacements[at] <= limit;
}

bool MeanForceStays(std::span<const ImuSample> samples) {
  const size_t half = samples.size() / 2;
  return (MomentsOf(samples.first(half)).accel_mean - MomentsOf(samples.subspan(half)).accel_mean)
             .norm() < kMaxStationaryAccelChange;
}

double SpanSeconds(int64_t from_utime, int64_t to_utime) {
  return 1e-6 * static_cast<double>(to_utime - from_utime);
}

double MeanMagnitude(const std::vector<ImuSample>& samples, Vector3d ImuSample::*of) {
  double sum = 0;
  for (const ImuSample& sample : samples) {
    sum += (sample.*of).norm();
  }
  return sum / static_cast<double>(samples.size());
}

// The ray that the first row would have seen, for a distant point: with a shaking hand, the
// rotation during the read-out is several pixels at the last row.
Vector2d RayOfFirstRow(const Vector2d& seen, double pixel_y, const CameraModel& camera,
                       const BodyMotion& motion) {
  if (camera.readout_s <= 0) {
    return seen;
  }
  const double row_s = camera.RowTime_s(pixel_y);
  const Eigen::Quaterniond& q_body_cam = camera.T_body_cam.q;
  const Vector3d ray =
      q_body_cam.conjugate() * (motion.After(row_s).q * (q_body_cam * seen.homogeneous()));
  return ray.z() > 0 ? Vector2d(ray.hnormalized()) : seen;
}

InitialState StationaryState(const TrackedFrame& frame, const SampleMoments& moments,
                             size_t num_samples, double bias_sigma) {
  InitialState state;
  state.stationary = true;
  ImuState imu;
  imu.T_odom_body.q = Eigen::Quaterniond::FromTwoVectors(moments.accel_mean, Vector3d::UnitZ());
  imu.gyro_bias = moments.gyro_mean;
  state.frames.push_back({frame, imu, 0});
  // For a stationary body, an accelerometer bias cannot be distinguished from a tilt: so the bias
  // determines the uncertainty of the tilt.
  Eigen::Matrix<double, 15, 1> sigma;
  const auto count = static_cast<double>(num_samples);
  const double tilt_sigma =
      std::sqrt(bias_sigma * bias_sigma + moments.accel_variance / count) / kGravity;
  const double gyro_bias_sigma =
      std::max(kMinGyroBiasSigma, std::sqrt(moments.gyro_variance / count));
  sigma << Vector3d(tilt_sigma, tilt_sigma, 1e-4), Vector3d::Constant(1e-4),
      Vector3d::Constant(0.01), Vector3d::Constant(gyro_bias_sigma), Vector3d::Constant(bias_sigma);
  state.covariance = sigma.cwiseAbs2().asDiagonal();
  return state;
}

}  // namespace

Initialiser::Initialiser(const CameraModel& camera, const ImuNoise& noise, double pixel_sigma,
                         const StartSigmas& sigmas, const StationaryOptions& stationary)
    : camera_(camera),
      noise_(noise),
      pixel_sigma_(pixel_sigma),
      sigmas_(sigmas),
      stationary_(stationary),
      focal_length_check_(camera, noise) {}

InitialResult Initialiser::AddFrame(const TrackedFrame& frame, std::span<const ImuSample> imu,
                                    double stamp_sigma_s) {
  sigmas_.stamp_s = stamp_sigma_s;
  if (auto why_not = Collect(frame, imu)) {
    return {std::nullopt, *why_not, false, suspect_};
  }
  InitialResult result = Try();
  why_not_ = result.reason;
  if (result.state) {
    suspect_.clear();
    last_attempt_utime_ = frame.utime;
  }
  result.suspect = suspect_;
  return result;
}

// Returns the reason if there is nothing new to start with.
std::optional<std::string> Initialiser::Collect(const TrackedFrame& frame,
                                                std::span<const ImuSample> imu) {
  samples_.insert(samples_.end(), imu.begin(), imu.end());
  if (samples_.empty() || samples_.back().utime < frame.utime) {
    return "no inertial samples up to the image's time";
  }
  if (!frames_.empty() && SpanSeconds(frames_.back().utime, frame.utime) < kFrameSpacing_s) {
    return why_not_;
  }
  frames_.push_back(frame);
  while (SpanSeconds(frames_.front().utime, frame.utime) > kMaxSpan_s) {
    frames_.erase(frames_.begin());
  }
  DropImagesBeforeSamples();
  if (frames_.empty()) {
    return "no inertial samples from before the image";
  }
  std::erase_if(samples_, [&](const ImuSample& sample) {
    return SpanSeconds(sample.utime, frames_.front().utime) > kSampleMargin_s;
  });
  return std::nullopt;
}

std::string Initialiser::CheckFocalLength(const TrackedFrame& frame,
                                          std::span<const ImuSample> imu) {
  if (focal_length_check_.is_complete() || Collect(frame, imu) ||
      SpanSeconds(last_attempt_utime_, frame.utime) < kCheckInterval_s) {
    return suspect_;
  }
  last_attempt_utime_ = frame.utime;
  focal_length_check_.Add([this](const CameraModel& camera) { return StartFrames(camera, 0); });
  if (const auto fault = focal_length_check_.Found()) {
    suspect_ = fault->text;
  }
  return suspect_;
}

// The motion from such an image to the next one is not known.
void Initialiser::DropImagesBeforeSamples() {
  std::erase_if(frames_, [&](const TrackedFrame& frame) {
    return SpanSeconds(frame.utime, samples_.front().utime) > time_offset_change_s_;
  });
}

InitialResult Initialiser::Try() {
  const double span = SpanSeconds(frames_.front().utime, frames_.back().utime);
  if (span < kMinSpan_s) {
    return {std::nullopt, fmt::format("collecting images: {:.1f} of {:.1f} s", span, kMinSpan_s)};
  }
  const double accel = MeanMagnitude(samples_, &ImuSample::accel);
  if (!(accel > kMinMeanAccel && accel < kMaxMeanAccel)) {
    return {std::nullopt,
            fmt::format("the accelerometer shows {:.2f} m/s^2 on average, where gravity is {:.1f}",
                        accel, kGravity)};
  }
  const double gyro = MeanMagnitude(samples_, &ImuSample::gyro);
  if (gyro > kMaxMeanGyro) {
    return {std::nullopt,
            fmt::format("the gyroscope shows {:.1f} rad/s on average: is it in degrees?", gyro)};
  }
  if (auto stationary = TryStationary()) {
    return {stationary, ""};
  }
  const int64_t now = frames_.back().utime;
  if (InDoubt() && SpanSeconds(last_attempt_utime_, now) < kDoubtfulInterval_s) {
    return {std::nullopt, why_not_};
  }
  last_attempt_utime_ = now;
  InitialResult result = TryMoving();
  NoteOutcome(result);
  return result;
}

bool Initialiser::InDoubt() const { return contradictions_ >= kDoubtful; }

void Initialiser::NoteOutcome(const InitialResult& result) {
  contradictions_ = std::max(0, contradictions_ + (result.contradicts ? 1 : -1));
  if (contradictions_ == kSearching || possible_fault_) {
    contradictions_ = kDoubtful;
    LookForFaults();
  }
}

// Names a mistake if the odometry would start without it, at two attempts.
void Initialiser::LookForFaults() {
  const FramesOf frames_of = [this](const CameraModel& camera) { return StartFrames(camera, 0); };
  const CalibrationFault fault =
      FaultByRotations(frames_of, camera_, noise_).value_or(NegatedAccelerometer(camera_));
  const auto before = std::exchange(possible_fault_, std::nullopt);
  if (TryMoving(WithoutFault(frames_of, fault), fault.camera.T_body_cam).state) {
    if (before && AreSame(*before, fault)) {
      suspect_ = fault.text;
    } else {
      possible_fault_ = fault;
    }
  }
}

std::optional<InitialState> Initialiser::TryStationary() const {
  const int64_t now = frames_.back().utime;
  const auto oldest = std::find_if(frames_.begin(), frames_.end(), [now](const TrackedFrame& one) {
    return SpanSeconds(one.utime, now) <= kStationarySpan_s + kFrameSpacing_s;
  });
  // Behind a gap in the images, the newest of them may span much less.
  if (SpanSeconds(oldest->utime, now) < kStationarySpan_s - kFrameSpacing_s) {
    return std::nullopt;
  }
  const std::vector<ImuSample> samples = SamplesBetween(samples_, oldest->utime, now);
  if (samples.size() < 20 || !DisplacedLessThan(kStationarySigmas * pixel_sigma_, 0.5,
                                                Displacements(*oldest, frames_.back()))) {
    return std::nullopt;
  }
  const SampleMoments moments = MomentsOf(samples);
  const double max_accel = kStationaryAccel * stationary_.accel_sigma;
  const double max_gyro = kStationaryGyro * kMaxStationaryRate;
  const bool quiet = moments.accel_variance <= max_accel * max_accel &&
                     moments.gyro_variance <= max_gyro * max_gyro;
  const auto shows_no_motion = [&](const TrackedFrame& frame) {
    return DisplacedLessThan(kStationaryMostSigmas * pixel_sigma_, kMostTracks,
                             Displacements(*oldest, frame));
  };
  if (!quiet && !(MeanForceStays(samples) && std::all_of(oldest, frames_.end(), shows_no_motion))) {
    return std::nullopt;
  }
  return StationaryState(frames_.back(), moments, samples.size(),
                         kStationaryBias * sigmas_.accel_bias);
}

// `camera`: camera_, or what it may be instead.
std::vector<StartFrame> Initialiser::StartFrames(const CameraModel& camera, double shift_s) const {
  const int64_t shift = std::llround(1e6 * shift_s);
  ImuBuffer samples(noise_);
  samples.Add(samples_);
  std::vector<StartFrame> frames;
  for (const TrackedFrame& frame : frames_) {
    StartFrame start;
    start.utime = frame.utime + shift;
    if (!frames.empty()) {
      start.imu = SamplesBetween(samples_, frames.back().utime, start.utime);
    }
    const BodyMotion motion = samples.MotionFrom(start.utime, camera.readout_s, {}, ImuState{});
    for (const Observation& observation : frame.observations) {
      const auto ray = camera.fx == camera_.fx ? std::optional(observation.ray)
                                               : camera.Unproject(observation.pixel.cast<double>());
      if (ray) {
        start.rays[observation.landmark_id] =
            RayOfFirstRow(*ray, observation.pixel.y(), camera, motion);
      }
    }
    frames.push_back(std::move(start));
  }
  return frames;
}

InitialResult Initialiser::TryMoving() {
  const std::vector<StartFrame> frames = StartFrames(camera_, time_offset_change_s_);
  InitialResult result = TryMoving(frames, camera_.T_body_cam);
  if (result.state || !result.contradicts) {
    return result;
  }
  // The time offset may differ from the calibrated one.
  const auto offset = SolveTimeOffset(frames, camera_.T_body_cam, samples_, noise_);
  if (!offset) {
    return result;
  }
  time_offset_change_s_ += *offset;
  DropImagesBeforeSamples();
  return TryMoving(StartFrames(camera_, time_offset_change_s_), camera_.T_body_cam);
}

// Empty if the start is good.
std::optional<InitialResult> Initialiser::Refusal(
    const std::optional<RefinedStart>& refined) const {
  if (!refined) {
    return InitialResult{std::nullopt, "the start-up bundle adjustment did not converge"};
  }
  if (refined->inlier_share < kMinInlierShare || refined->rms_sigma > kMaxRmsSigmas) {
    const std::string found = refined->inlier_share < kMinInlierShare
                                  ? fmt::format("{:.0f} % inliers", 100 * refined->inlier_share)
                                  : fmt::format("{:.1f} sigma", refined->rms_sigma);
    return InitialResult{std::nullopt, "the start does not explain the images: " + found, true};
  }
  // The scale must be certain, so the limit is relative to the speed: with a limit in m/s, a
  // solution at half the true scale would pass first.
  const double speed = refined->states.back().v_odom_body.norm();
  const double max_velocity_sigma = std::max(kMaxVelocitySigma, kMaxSpeedShare * speed);
  if (refined->velocity_sigma > max_velocity_sigma || refined->tilt_sigma > kMaxTiltSigma) {
    return InitialResult{
        std::nullopt,
        fmt::format("not enough motion yet: velocity known to {:.2f} m/s, tilt to {:.1f} degrees",
                    refined->velocity_sigma, refined->tilt_sigma * 57.3)};
  }
  if (refined->states.back().accel_bias.norm() > kMaxAccelBias * sigmas_.accel_bias) {
    return InitialResult{std::nullopt, "the start needs an implausible accelerometer bias", true};
  }
  return std::nullopt;
}

std::optional<MovingStart> Initialiser::StartFrom(const Vector3d& gyro_bias,
                                                  const std::vector<StartFrame>& frames,
                                                  const Rigid3& T_body_cam) const {
  auto linear = SolveLinear(frames, T_body_cam, noise_, gyro_bias);
  if (!linear) {
    return std::nullopt;
  }
  const auto refine = [&frames, T_body_cam, gyro_bias, sigmas = sigmas_,
                       noise = MeasuredNoise(noise_, samples_)](const LinearStart& start) {
    return Refine(frames, T_body_cam, noise, gyro_bias, start, sigmas);
  };
  std::optional<RefinedStart> refined = RefineInFront(refine, &*linear);
  return MovingStart{refine, *std::move(linear), std::move(refined)};
}

InitialResult Initialiser::TryMoving(const std::vector<StartFrame>& frames,
                                     const Rigid3& T_body_cam) const {
  const auto gyro_bias = SolveGyroBias(frames, T_body_cam, noise_);
  if (!gyro_bias) {
    return {std::nullopt, "too few features are tracked from image to image", true};
  }
  std::optional<MovingStart> start = StartFrom(*gyro_bias, frames, T_body_cam);
  if (gyro_bias->norm() > kUsualGyroBias) {
    start = BetterOf(std::move(start), StartFrom(Vector3d::Zero(), frames, T_body_cam));
  }
  if (!start) {
    return {std::nullopt, "the motion does not determine velocity and gravity yet"};
  }
  if (auto refusal = Refusal(start->refined)) {
    return *refusal;
  }
  const RefinedStart refined = BestOfScales(start->refine, start->linear, *start->refined);
  if (auto refusal = Refusal(refined)) {
    return *refusal;
  }
  InitialState state;
  state.time_offset_change_s = time_offset_change_s_;
  state.time_offset_error_s = refined.time_offset_error_s;
  for (size_t i = 0; i < frames_.size(); ++i) {
    state.frames.push_back({frames_[i], refined.states[i], refined.stamp_errors_s[i]});
  }
  return {state, ""};
}

}  // namespace pangea::vio
