#include "vio/vio_process.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <functional>
#include <iostream>
#include <stdexcept>
#include <system_error>

#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/messages.h"
#include "pangea/pose_t.hpp"
#include "recording/tum.h"

namespace pangea::vio {
namespace {

constexpr int64_t kLagToldInterval_us = 10'000'000;
constexpr int64_t kNotableLag_us = 500'000;

constexpr char kTracking[] = "tracking";
constexpr char kSaturated[] =
    "the IMU is at the end of its range, and does not see the whole motion";
constexpr char kContradicted[] =
    "the IMU feels an acceleration that the images do not show: a lift, a vehicle?";

// A text for the status if the motion has not made the scale observable; else empty.
std::string UnknownScale(const std::optional<double>& sigma) {
  return sigma && *sigma > kMetricScaleSigma
             ? fmt::format(
                   "the scale is known to {:.0f} % at best: it takes acceleration, not even "
                   "motion or turning",
                   100 * *sigma)
             : "";
}

std::string WithSuspect(const VioOutput& output) {
  return output.suspect.empty() ? output.reason
                                : fmt::format("{}; probably {}", output.reason, output.suspect);
}

int8_t ToMessage(EstimatorState state) {
  switch (state) {
    case EstimatorState::kInitialising:
      return pose_t::STATE_INITIALISING;
    case EstimatorState::kTracking:
      return pose_t::STATE_TRACKING;
    case EstimatorState::kLost:
      return pose_t::STATE_LOST;
  }
  return pose_t::STATE_INVALID;
}

}  // namespace

VioProcess::VioProcess(Bus& bus, const VioProcessOptions& options, int64_t now_utime)
    : options_(options),
      node_(bus, fmt::format("vio_{}", options.agent_id)),
      publisher_(node_, options.agent_id, kKeptKeyframes, now_utime),
      announcer_(bus, node_.name(), options.told_options) {
  node_.Listen<correction_t>(channels::Correction(options_.agent_id),
                             std::bind_front(&VioProcess::OnCorrection, this));
  node_.Listen<landmarks_t>(channels::Landmarks(options_.agent_id),
                            std::bind_front(&VioProcess::OnLandmarks, this));
  if (!options_.out_keyframes.empty()) {
    keyframe_log_.emplace(options_.out_keyframes);
  }
  if (!options_.out_tum.empty()) {
    OpenTum(options_.out_tum);
    if (output_error_) {
      throw std::runtime_error(*output_error_);
    }
  }
}

VioProcess::~VioProcess() = default;

void VioProcess::Open(const CameraModel& camera, const ImuNoise& noise,
                      const std::optional<CalibrationSigmas>& sigmas) {
  const auto open_map = [this, opened = int64_t{0}]() mutable {
    return options_.map_utime ? *options_.map_utime + opened++ : WallUtime();
  };
  VioOptions vio = options_.vio;
  vio.estimator.calibration = sigmas.value_or(vio.estimator.calibration);
  vio_.emplace(options_.agent_id, camera, noise, vio, open_map);
}

void VioProcess::AddImage(int64_t utime, const cv::Mat& image, std::span<const ImuSample> imu) {
  NoteSaturation(imu);
  Handle(vio_->AddImage(utime, image, imu));
}

void VioProcess::AddTracks(const TrackedFrame& frame, const cv::Mat& image,
                           std::span<const ImuSample> imu) {
  NoteSaturation(imu);
  Handle(vio_->AddTracks(frame, image, imu));
}

void VioProcess::NoteSaturation(std::span<const ImuSample> imu) {
  const auto found = std::count_if(
      imu.begin(), imu.end(), [this](const ImuSample& sample) { return saturation_.Add(sample); });
  saturated_ = found > 0;
  if (saturated_) {
    num_saturated_ += found;
    node_.Set("imu_saturated", num_saturated_);
  }
}

void VioProcess::Handle(const VioOutput& output) {
  if (output.repeats) {
    ++num_repeated_;
    node_.Set("images_repeated", num_repeated_);
    return;
  }
  if (!first_image_utime_) {
    first_image_utime_ = output.utime;
  }
  const bool tracking = output.state == EstimatorState::kTracking;
  if (tracking) {
    pose_count_.AddPose(output.utime, output.suspect);
  } else {
    pose_count_.AddNone(output.utime, output.reason, output.suspect);
  }
  node_.Count("frames");
  node_.Set("maps", vio_->maps_opened());
  node_.Set("tracked", output.num_tracked);
  if (tracking && !state_text_.starts_with(kTracking)) {
    node_.Set("initialised_ms", (output.utime - *first_image_utime_) / 1000);
  }
  doubt_ = !tracking                 ? ""
           : saturated_              ? kSaturated
           : output.imu_contradicted ? kContradicted
           : !output.suspect.empty() ? "probably " + output.suspect
                                     : UnknownScale(output.scale_sigma);
  if (output.imu_contradicted) {
    node_.Count("imu_contradicted");
  }
  if (output.scale_sigma) {
    node_.Set("scale_sigma_permille", std::llround(1000 * *output.scale_sigma));
  }
  state_text_ =
      tracking
          ? std::string(kTracking) + (output.stationary ? ", stationary" : "")
          : fmt::format("{}: {}", output.state == EstimatorState::kLost ? "lost" : "initialising",
                        WithSuspect(output));
  if (output.state == EstimatorState::kLost) {
    node_.Count("lost");
  }
  FollowMaps(output);
  Localise(output);
  PublishPose(output);
  for (const Keyframe& keyframe : output.keyframes) {
    PublishKeyframe(keyframe);
  }
  if (tracking) {
    WriteTum(output);
  }
}

void VioProcess::FollowMaps(const VioOutput& output) {
  if (output.map != shown_map_) {
    shown_map_ = output.map;
    shown_.Reset(output.map);
    localization_.Reset(output.map);
  }
  for (const Keyframe& keyframe : output.keyframes) {
    localization_.NotePublished(keyframe);
  }
}

// Looks for landmarks of the map in a new keyframe. Without landmarks the window's covariance is
// not computed.
void VioProcess::Localise(const VioOutput& output) {
  if (!output.is_keyframe || !localization_.HasLandmarks()) {
    return;
  }
  const Vio::View view = vio_->NewestKeyframe(output);
  localization_.AddKeyframe(view.camera, view.corners, view.descriptor_kind, view.window);
  shown_.Sharpen(*localization_.T_map_odom());
  const MapLocalisation::Counters& counters = localization_.counters();
  node_.Set("keyframes_localised", counters.localised);
  node_.Set("keyframes_not_localised", counters.not_localised);
  node_.Set("landmarks_seen", counters.seen);
}

void VioProcess::PublishPose(const VioOutput& output) {
  pose_t message{};
  message.utime = output.utime;
  message.state = ToMessage(output.state);
  message.reason = output.state == EstimatorState::kTracking ? doubt_ : WithSuspect(output);
  message.map = pangea::ToMessage(output.map);
  message.T_odom_body = pangea::ToMessage(output.T_odom_body);
  message.v_odom_body = pangea::ToMessage(output.v_odom_body);
  message.T_map_body = pangea::ToMessage(output.state == EstimatorState::kTracking
                                             ? shown_.Show(output.utime, output.T_odom_body)
                                             : output.T_odom_body);
  message.group_revision = shown_.revision();
  message.num_tracked = output.num_tracked;
  node_.Publish(channels::Pose(options_.agent_id), message);
}

void VioProcess::PublishKeyframe(const Keyframe& keyframe) {
  ++num_keyframes_;
  std::vector<uint8_t> bytes = EncodeMessage(pangea::ToMessage(keyframe));
  if (keyframe_log_) {
    keyframe_log_->Write(keyframe.utime, channels::Keyframe(options_.agent_id), bytes);
  }
  publisher_.Publish(keyframe.id, std::move(bytes));
}

void VioProcess::WriteTum(const VioOutput& output) {
  if (options_.out_tum.empty() || output_error_) {
    return;
  }
  if (tum_map_ != output.map) {
    tum_map_ = output.map;
    if (++tum_files_ > 1) {
      OpenTum(fmt::format("{}.{}", options_.out_tum, tum_files_));
    }
  }
  tum_ << ToTum({{output.utime, output.T_odom_body}}) << std::flush;
  NoteTumFailure();
}

void VioProcess::OpenTum(const std::string& file) {
  tum_file_ = file;
  tum_ = std::ofstream(file);
  NoteTumFailure();
}

void VioProcess::NoteTumFailure() {
  if (!tum_ && !output_error_) {
    output_error_ =
        fmt::format("{}: cannot be written: {}", tum_file_, std::generic_category().message(errno));
  }
}

std::string VioProcess::Totals() const {
  std::string text =
      fmt::format("agent {}: {} of {} images have a pose; {} keyframes in {} map{}",
                  options_.agent_id, pose_count_.poses(), pose_count_.images(), num_keyframes_,
                  vio_->maps_opened(), vio_->maps_opened() == 1 ? "" : "s");
  if (tum_files_ > 1) {
    text += fmt::format("; the last of {} TUM files is {}", tum_files_, tum_file_);
  }
  if (num_saturated_ > 0) {
    text +=
        fmt::format("; {} inertial samples were at the end of the sensor's range", num_saturated_);
  }
  if (num_repeated_ > 0) {
    text += fmt::format("; {} more images repeat the one before them and have none", num_repeated_);
  }
  if (num_dropped_ > 0) {
    text += fmt::format("; {} more images were dropped, as this machine is too slow for real time",
                        num_dropped_);
  }
  return text;
}

std::optional<std::string> VioProcess::WhyFewPoses() const {
  if (pose_count_.images() > 0) {
    return pose_count_.WhyFew();
  }
  return "no pose: no image came to the odometry" +
         (why_refused_.empty() ? "" : " that could be used; the last one: " + why_refused_);
}

void VioProcess::StartAnew() {
  if (!vio_) {
    return;
  }
  for (const Keyframe& keyframe : vio_->StartAnew()) {
    PublishKeyframe(keyframe);
  }
  shown_map_ = {};
  tum_map_.reset();
  first_image_utime_.reset();
  node_.Count("started_anew");
}

void VioProcess::Flush() {
  if (vio_) {
    for (const Keyframe& keyframe : vio_->Flush()) {
      PublishKeyframe(keyframe);
    }
  }
  keyframe_log_.reset();
  state_text_ = "at the end of its images";
}

void VioProcess::PublishFinished(int64_t now_utime) {
  node_.Set("finished", 1);
  node_.PublishStatus(now_utime, publisher_.Unacknowledged(), "finished");
}

void VioProcess::Tick(int64_t now_utime) {
  publisher_.Tick(now_utime);
  if (!options_.told_options.empty()) {
    announcer_.Tick(now_utime);
  }
  if (node_.StatusIsDue(now_utime)) {
    node_.PublishStatus(now_utime, publisher_.Unacknowledged(), Summary());
  }
  TellLag(now_utime);
}

std::string VioProcess::Summary() const {
  return fmt::format("agent {}: {}{}{}", options_.agent_id, state_text_,
                     doubt_.empty() ? "" : "; " + doubt_,
                     lag_us_ >= kNotableLag_us ? "; " + LagText(lag_us_) : "");
}

std::string VioProcess::LagText(int64_t lag_us) const {
  return fmt::format("lag {:.1f} s, {} images dropped", 1e-6 * static_cast<double>(lag_us),
                     num_dropped_);
}

void VioProcess::RefuseImage(const std::string& why) {
  node_.Refuse("image: " + why);
  why_refused_ = why;
  if (pose_count_.images() == 0) {
    state_text_ = "waiting for images that can be used; the last one: " + why;
  }
}

void VioProcess::NoteLag(int64_t lag_us, int64_t dropped) {
  lag_us_ = lag_us;
  largest_lag_us_ = std::max(largest_lag_us_, lag_us);
  num_dropped_ += dropped;
  node_.Set("lag_ms", lag_us / 1000);
  node_.Set("images_dropped", num_dropped_);
  node_.NoteDropped(dropped);
}

void VioProcess::TellLag(int64_t now_utime) {
  const bool behind = num_dropped_ > num_dropped_told_ || largest_lag_us_ > kMaxLag_us;
  if (!behind || now_utime < next_lag_told_utime_) {
    return;
  }
  num_dropped_told_ = num_dropped_;
  next_lag_told_utime_ = now_utime + kLagToldInterval_us;
  std::cerr << fmt::format(
                   "pangea-vio: agent {} cannot keep up: {} of {}; fewer or smaller images, or a "
                   "quicker machine\n",
                   options_.agent_id, LagText(largest_lag_us_), pose_count_.images() + num_dropped_)
            << std::flush;
  largest_lag_us_ = 0;
}

void VioProcess::OnCorrection(const Correction& correction) {
  if (shown_.Correct(correction)) {
    node_.Count("corrections");
    vio_->NoteCorrection(correction.map, correction.revision);
    localization_.Correct(correction);
    shown_.Sharpen(*localization_.T_map_odom());
  }
}

void VioProcess::OnLandmarks(const MapLandmarks& landmarks) {
  node_.Count(localization_.Take(landmarks) ? "landmark_messages" : "landmark_messages_unused");
}

}  // namespace pangea::vio
