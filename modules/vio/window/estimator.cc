#include "vio/window/estimator.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "vio/imu/imu_buffer.h"
#include "vio/imu/imu_noise.h"
#include "vio/imu/stationary_detector.h"
#include "vio/initialisation/initialiser.h"
#include "vio/keyframes/frame_choice.h"
#include "vio/keyframes/keyframe_edges.h"
#include "vio/keyframes/track_history.h"
#include "vio/window/image_stamps.h"
#include "vio/window/landmarks/landmark_check.h"
#include "vio/window/landmarks/landmark_store.h"
#include "vio/window/plausibility.h"
#include "vio/window/unmodelled_acceleration.h"
#include "vio/window/window_problem.h"
#include "vio/window/window_solver.h"
#include "vio/window/window_start.h"

namespace pangea::vio {
namespace {

using Eigen::MatrixXd;

constexpr double kMaxFrameGap_s = 1.0;
constexpr int64_t kStartSpan_us = 4'000'000;  // span of samples that a start may need

// With a rough calibration, unmodelled errors change the measured accelerations slowly, like a
// drifting bias. A start separates tilt from bias by a small rotation only, and would then be far
// too confident. So for a while after a start the accelerometer's random walk is multiplied by this
// factor (docs/decisions/imu.md).
constexpr int64_t kSettling_us = 2'000'000;
constexpr double kSettlingWalk = 10;

constexpr double kMaxStationaryGap_s = 0.5;  // from the last stationary window keyframe to motion

constexpr int kMaxIterations = 4;
// A start has no earlier solution: with little information four iterations end half way.
constexpr int kStartIterations = 20;

double Seconds(int64_t us) { return 1e-6 * static_cast<double>(us); }

}  // namespace

struct Estimator::Impl {
  Impl(const EstimatorOptions& o, const CameraModel& c, const ImuNoise& n)
      : options(o),
        camera(c),
        noise(WithUsualWalks(n)),
        ray_sigma(o.pixel_sigma * c.PixelAngle()),
        is_rough(IsRough(c, o.calibration)),
        initialiser(c, noise, o.pixel_sigma,
                    {.ray = ray_sigma,
                     .accel_bias = o.accel_bias_sigma,
                     .time_offset_s = o.calibration.time_offset_s},
                    o.stationary),
        imu_samples(noise),
        stationary_detector(c, ray_sigma, o.stationary),
        stamps(c),
        choice(o, c) {
    problem.state.T_body_cam = c.T_body_cam;
    problem.state.time_offset_s = c.time_offset_s;
  }

  FrameResult AddFrame(const TrackedFrame& frame, std::span<const ImuSample> imu);
  std::vector<FinishedKeyframe> Flush();

  // Says why in the result, if the estimator has not started with this frame.
  void TryStart(const TrackedFrame& frame, std::span<const ImuSample> imu, FrameResult* result);
  // Returns the reason if the estimator is lost.
  std::optional<std::string> Track(const TrackedFrame& frame, FrameResult* result);
  // A gap in images or samples over which the window cannot be continued.
  std::optional<std::string> GapBefore(const TrackedFrame& frame);
  void TellNewest(FrameResult* result);
  void Start(const InitialState& initial);
  ImuFactor MakeImuFactor(const WindowFrame& from, int64_t to_imu_utime) const;
  void Append(int64_t utime, const ImuState& imu, std::optional<ImuFactor> factor);
  void AddToWindow(const TrackedFrame& frame);
  void DropNonKeyframe();
  std::vector<int32_t> Solve(int max_iterations);
  void MarginaliseLandmarks(int frame);
  void ShrinkWindow(std::vector<FinishedKeyframe>* finished);
  void PublishUpTo(int newest, std::vector<FinishedKeyframe>* finished);
  // On the IMU's clock, with the time offset of the newest image.
  int64_t ImuTime(int64_t frame_utime) const {
    return frame_utime + std::llround(1e6 * problem.state.TimeOffsetAt(excess_interval_s));
  }
  int64_t ImuTime(const WindowFrame& frame) const {
    return frame.utime + std::llround(1e6 * problem.state.TimeOffsetOf(frame));
  }
  WindowFrame& Newest() { return problem.state.frames.back(); }
  const WindowFrame& LastWindowKeyframe() const {
    const auto& frames = problem.state.frames;
    return frames.back().is_window_keyframe ? frames.back() : frames[frames.size() - 2];
  }

  EstimatorOptions options;
  CameraModel camera;
  ImuNoise noise;
  double ray_sigma;
  bool is_rough;  // whether the calibration is rough
  Initialiser initialiser;
  bool started = false;
  int64_t settled_imu_utime = std::numeric_limits<int64_t>::max();
  WindowProblem problem;
  TrackHistory history;
  LandmarkStore landmarks;
  ImuBuffer imu_samples;  // since the last published keyframe
  StationaryDetector stationary_detector;
  ImageStamps stamps;
  double excess_interval_s = 0;  // of the newest image
  FrameChoice choice;
  KeyframeEdges keyframe_edges;
  int64_t last_tracked = 0;  // utime of the newest tracked image
  bool lost = false;
};

// The window takes over the frames from which the start was found, and goes on refining them. It
// takes all of them, and marginalises the surplus: if the camera rotates on the spot, hardly two
// are far enough apart to be window keyframes, and these two determine neither speed nor tilt.
void Estimator::Impl::Start(const InitialState& initial) {
  const int64_t offset_us = ImuTime(0);  // the offset with which the initialiser got the frames
  problem.state.time_offset_s += initial.time_offset_change_s;
  for (const InitialState::Frame& from : initial.frames) {
    TrackedFrame tracked = from.tracked;
    tracked.utime -= offset_us;
    history.AddFrame(tracked, camera, ray_sigma);
    if (problem.state.frames.empty()) {
      Append(tracked.utime, from.imu, std::nullopt);
      problem.prior =
          initial.stationary
              ? StartPrior(problem.state, initial.covariance, camera, options.calibration, noise)
              : MovingStartPrior(problem.state, camera, options.calibration, noise,
                                 options.accel_bias_sigma);
    } else {
      Append(tracked.utime, from.imu, MakeImuFactor(Newest(), ImuTime(tracked.utime)));
    }
    if (Newest().has_stamp_error()) {
      Newest().stamp_error_s = from.stamp_error_s;
    }
    Newest().is_window_keyframe = true;
  }
  Newest().stationary = initial.stationary;
  problem.state.time_offset_s += initial.time_offset_error_s;
  started = true;
  settled_imu_utime = Newest().imu_utime + kSettling_us;
}

ImuFactor Estimator::Impl::MakeImuFactor(const WindowFrame& from, int64_t to_imu_utime) const {
  ImuFactor factor;
  factor.span = imu_samples.Integrate(from.imu_utime, to_imu_utime, problem.state.imu_intrinsics,
                                      from.imu.gyro_bias, from.imu.accel_bias);
  factor.noise = noise;
  if (is_rough && to_imu_utime < settled_imu_utime) {
    factor.noise.accel_random_walk *= kSettlingWalk;
  }
  factor.information = InertialInformation(factor.span.measured, factor.noise);
  return factor;
}

void Estimator::Impl::Append(int64_t utime, const ImuState& imu, std::optional<ImuFactor> factor) {
  WindowFrame frame;
  frame.utime = utime;
  frame.imu_utime = ImuTime(utime);
  frame.excess_interval_s = excess_interval_s;
  frame.time_offset_s = problem.state.TimeOffsetOf(frame);
  frame.stamp_sigma_s = stamps.sigma_s();
  frame.imu = imu;
  const BodyMotion motion =
      imu_samples.MotionFrom(frame.imu_utime, camera.readout_s, problem.state.imu_intrinsics, imu);
  frame.omega_body = motion.omega;
  frame.alpha_body = motion.alpha;
  frame.a_body = motion.a;
  problem.state.frames.push_back(frame);
  problem.imu_factors.push_back(std::move(factor));
}

// A frame that is not a window keyframe makes room for the next one: its rays are dropped, and its
// inertial samples are integrated again as a part of the longer span.
void Estimator::Impl::DropNonKeyframe() {
  if (!Newest().is_window_keyframe) {
    history.RemoveFrame(Newest().utime);
    problem.state.frames.pop_back();
    problem.imu_factors.pop_back();
  }
}

void Estimator::Impl::AddToWindow(const TrackedFrame& frame) {
  history.AddFrame(frame, camera, ray_sigma);
  const auto since_stop =
      LastWindowKeyframe().stationary
          ? std::optional(history.ShiftSigmasBetween(LastWindowKeyframe().utime, frame.utime))
          : std::nullopt;
  const bool stationary =
      stationary_detector.AddFrame(frame, since_stop, imu_samples, Newest().imu.gyro_bias);
  const bool is_tracked = history.Continues(Newest().utime, frame.utime);
  // The last stationary frame keeps its place when motion begins. Samples integrated from an
  // earlier one, seconds ago, would let the pose step.
  Newest().is_window_keyframe |=
      Newest().stationary && !stationary &&
      Seconds(Newest().utime - LastWindowKeyframe().utime) > kMaxStationaryGap_s;
  DropNonKeyframe();
  const ImuFactor factor = MakeImuFactor(Newest(), ImuTime(frame.utime));
  // A stationary frame begins where the last one stood: what seconds of shaken samples predict may
  // be too far off for a few iterations.
  const bool is_held = stationary && Newest().stationary;
  Append(frame.utime, is_held ? Newest().imu : Predict(factor.span.measured, Newest().imu), factor);
  Newest().stationary = stationary;
  Newest().is_tracked = is_tracked;
}

// Optimises the window; returns the outliers among the newest image's tracks.
std::vector<int32_t> Estimator::Impl::Solve(int max_iterations) {
  problem.landmarks = landmarks.Gather(problem.state, history);
  Optimise(problem, max_iterations);
  if (AllowForUnmodelledAcceleration(&problem)) {
    Optimise(problem, max_iterations);
  }
  keyframe_edges.NoteContradicted(problem);
  std::vector<int32_t> outliers;
  const int newest = problem.state.Newest();
  RowViews rows(problem.state);
  std::erase_if(problem.landmarks, [&](const Landmark& landmark) {
    if (!IsOutlier(rows, landmark)) {
      return false;
    }
    history.RemoveLandmark(landmark.id);
    if (IsSeenIn(newest, landmark)) {
      outliers.push_back(landmark.id);
    }
    return true;
  });
  landmarks.Keep(problem);
  last_tracked = Newest().is_tracked ? Newest().utime : last_tracked;
  return outliers;
}

// Publishes the keyframes up to frame `newest` that are not yet published.
void Estimator::Impl::PublishUpTo(int newest, std::vector<FinishedKeyframe>* finished) {
  std::vector<int> due;
  // Rows of the covariance that publishing needs
  std::vector<int> rows = RowsOfPoses(problem.state);
  for (int i = 0; i <= newest; ++i) {
    const WindowFrame& frame = problem.state.frames[i];
    if (frame.is_keyframe && !frame.is_published) {
      due.push_back(i);
      for (int k = kPoseSize; k < kFrameSize; ++k) {
        rows.push_back(problem.state.FirstRow(i) + k);
      }
    }
  }
  if (!due.empty()) {
    const MatrixXd P = WindowCovariance(problem, rows);
    for (const int i : due) {
      finished->push_back(keyframe_edges.Finish(problem.state, P, history, imu_samples, i));
    }
  }
}

void Estimator::Impl::ShrinkWindow(std::vector<FinishedKeyframe>* finished) {
  WindowState& state = problem.state;
  int due = -1;  // keyframes up to this frame have waited long enough
  for (int i = 0; i <= state.Newest(); ++i) {
    due = Seconds(Newest().utime - state.frames[i].utime) > kKeyframeInterval_s ? i : due;
  }
  PublishUpTo(due, finished);
  while (Newest().is_window_keyframe) {
    const int oldest = state.frames.front().pose_only ? 1 : 0;
    if (state.Newest() + 1 - oldest <= options.window) {
      break;
    }
    PublishUpTo(oldest, finished);
    const int64_t published = keyframe_edges.last_utime().value_or(0);
    Marginalisation what;
    what.keep_pose = state.frames[oldest].utime == published;
    what.drop_kept_pose = state.frames.front().utime != published;
    MarginaliseLandmarks(oldest);
    history.RemoveFrame(state.frames[oldest].utime);
    MarginaliseOldest(problem, what);
  }
  landmarks.Forget(history);
  const int published =
      state.Find(keyframe_edges.last_utime().value_or(0)).value_or(state.Newest());
  imu_samples.Forget(std::min(state.frames.front().imu_utime, ImuTime(state.frames[published])));
}

// Before `frame` is marginalised: the landmarks anchored in it will add their information to the
// prior, and start anew. Those that do not fit are removed, so they add nothing.
void Estimator::Impl::MarginaliseLandmarks(int frame) {
  RowViews rows(problem.state);
  std::erase_if(problem.landmarks, [&](const Landmark& landmark) {
    if (landmark.point.anchor != frame) {
      return false;
    }
    landmarks.StartAnew(landmark.id, Newest().utime);
    return !FitsAsWhole(rows, landmark);
  });
}

void Estimator::Impl::TryStart(const TrackedFrame& frame, std::span<const ImuSample> imu,
                               FrameResult* result) {
  imu_samples.Forget(ImuTime(frame.utime) - kStartSpan_us);
  TrackedFrame shifted = frame;  // the initialiser works on the IMU's clock
  shifted.utime = ImuTime(frame.utime);
  const InitialResult initial = initialiser.AddFrame(shifted, imu, stamps.sigma_s());
  if (!initial.state) {
    result->reason = initial.reason;
    result->suspect = initial.suspect;
    result->in_doubt = initialiser.InDoubt();
    return;
  }
  Start(*initial.state);
  stamps.SetReference();
  Solve(kStartIterations);
}

std::optional<std::string> Estimator::Impl::GapBefore(const TrackedFrame& frame) {
  const double gap_s = Seconds(frame.utime - Newest().utime);
  if (gap_s > kMaxFrameGap_s) {
    return fmt::format("no images for {:.1f} s", gap_s);
  }
  return imu_samples.Gap(Newest().imu_utime, ImuTime(frame.utime));
}

std::optional<std::string> Estimator::Impl::Track(const TrackedFrame& frame, FrameResult* result) {
  if (lost) {
    return "lost before";
  }
  excess_interval_s = stamps.excess_interval_s();
  if (auto gap = GapBefore(frame)) {
    PublishUpTo(problem.state.Newest(), &result->finished);  // a gap does not spoil the window
    return gap;
  }
  AddToWindow(frame);
  result->outlier_landmarks = Solve(kMaxIterations);
  return std::nullopt;
}

void Estimator::Impl::TellNewest(FrameResult* result) {
  const int newest = problem.state.Newest();
  result->T_odom_body = problem.state.PoseAhead(newest, problem.state.Ahead(newest, 0));
  result->v_odom_body = Newest().imu.v_odom_body;
  result->motion = problem.state.MotionAhead(newest, problem.state.Ahead(newest, 0));
  result->gyro_bias = Newest().imu.gyro_bias;
  result->accel_bias = Newest().imu.accel_bias;
  result->is_keyframe = Newest().is_keyframe;
  result->stationary = Newest().stationary;
  const auto& factor = problem.imu_factors.back();
  result->imu_contradicted = factor && factor->contradicted;
}

FrameResult Estimator::Impl::AddFrame(const TrackedFrame& frame, std::span<const ImuSample> imu) {
  FrameResult result;
  imu_samples.Add(imu);
  stamps.AddImage(frame.utime);
  std::optional<std::string> wrong;
  if (started) {
    TrackedFrame shifted = frame;
    shifted.utime = ImuTime(frame.utime);
    result.suspect = initialiser.CheckFocalLength(shifted, imu);
    wrong = Track(frame, &result);
  } else {
    TryStart(frame, imu, &result);
  }
  if (!started) {
    return result;
  }
  if (!wrong) {
    wrong = Implausible(Newest(), last_tracked);
  }
  if (wrong) {
    lost = true;
    result.state = EstimatorState::kLost;
    result.reason = *wrong;
    return result;
  }
  choice.Choose(history, &problem.state);
  ShrinkWindow(&result.finished);
  result.state = EstimatorState::kTracking;
  TellNewest(&result);
  return result;
}

std::vector<FinishedKeyframe> Estimator::Impl::Flush() {
  std::vector<FinishedKeyframe> finished;
  PublishUpTo(problem.state.Newest(), &finished);
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

// The returned time offset is that of the newest image.
CameraModel Estimator::camera() const {
  const WindowState& state = impl_->problem.state;
  CameraModel camera = state.Calibrated(impl_->camera);
  camera.time_offset_s =
      state.frames.empty() ? state.time_offset_s : state.TimeOffsetOf(state.frames.back());
  return camera;
}

WindowPoses Estimator::Poses() const { return PosesOf(impl_->problem); }

}  // namespace pangea::vio
