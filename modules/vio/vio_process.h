#pragma once

// The odometry on an agent's bus. Images come from a player (playback.h) or from the bus itself
// (live_input.h); this class only gets images with their inertial samples.
//
//   Out: POSE_k at every image, KEYFRAME_k once each, STATUS_vio_k at 1 Hz, OPTIONS_vio_k.
//   In: CORRECTION_k, LANDMARKS_k; HAVE, RESEND_REQUEST (with answers on AGAIN_<requester>) as in
//   reliable_keyframe_publisher.h, for the newest kKeptKeyframes.

#include <cstdint>
#include <fstream>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bus/node.h"
#include "bus/options_announcer.h"
#include "bus/process.h"
#include "bus/retransmission/reliable_keyframe_publisher.h"
#include "log_file/log_writer.h"
#include "vio/imu/saturation.h"
#include "vio/live/map_localisation.h"
#include "vio/live/shown_pose.h"
#include "vio/pose_count.h"
#include "vio/vio.h"

namespace lcm {
class LogFile;
}

namespace pangea::vio {

struct VioProcessOptions {
  int32_t agent_id = 0;
  VioOptions vio;
  // opened_utime of the first map; each further map has one more. If empty: the wall clock.
  std::optional<int64_t> map_utime;
  // Text published on OPTIONS_vio_k; if empty, nothing is published.
  std::string told_options;
  // File for the raw odometry at camera rate, in TUM format; a second map goes to FILE.2, a third
  // to FILE.3. Empty for none.
  std::string out_tum;
  // LCM log for the keyframes; empty for none.
  std::string out_keyframes;
};

class VioProcess : public Process {
 public:
  static constexpr size_t kKeptKeyframes = 200;
  // In real time, images further behind the newest one than this are dropped, the oldest first. An
  // odometry that cannot keep up therefore skips images, and its lag stays bounded.
  static constexpr int64_t kMaxLag_us = 1'000'000;

  // Throws std::runtime_error if an output file cannot be written.
  VioProcess(Bus& bus, const VioProcessOptions& options, int64_t now_utime);
  ~VioProcess() override;

  // Sets the calibration; call before the first image. `sigmas`, if given, replace those of the
  // options.
  void Open(const CameraModel& camera, const ImuNoise& noise,
            const std::optional<CalibrationSigmas>& sigmas = std::nullopt);
  bool open() const { return vio_.has_value(); }

  // Like Vio::AddImage and Vio::AddTracks.
  void AddImage(int64_t utime, const cv::Mat& image, std::span<const ImuSample> imu);
  void AddTracks(const TrackedFrame& frame, const cv::Mat& image, std::span<const ImuSample> imu);
  // Counts an image that cannot be used. Until one can, the status says why none is.
  void RefuseImage(const std::string& why);
  // Reports how far the odometry is behind its sensors, and how many images were dropped for this
  // since the last call. Published in the status, and printed on stderr if the odometry cannot keep
  // up.
  void NoteLag(int64_t lag_us, int64_t dropped);
  // Call when the sensors' time begins anew: finishes the map and opens another.
  void StartAnew();
  // Call after the last image: finishes the keyframes in the window.
  void Flush();
  // A summary of all images so far, for people.
  std::string Totals() const;
  // Why few or no images have given a pose so far (pose_count.h); empty if enough have.
  std::optional<std::string> WhyFewPoses() const;
  // Why the file of poses is incomplete (for instance a full disk); the odometry goes on without
  // it.
  const std::optional<std::string>& output_error() const { return output_error_; }
  // Publishes the last status, with the counter finished = 1.
  void PublishFinished(int64_t now_utime);

  void Tick(int64_t now_utime) override;

  int64_t ImuTimeOf(int64_t image_utime) const { return vio_->ImuTimeOf(image_utime); }
  const ReliableKeyframePublisher& publisher() const { return publisher_; }
  Node& node() { return node_; }

 private:
  void OnCorrection(const Correction& correction);
  void OnLandmarks(const MapLandmarks& landmarks);
  void FollowMaps(const VioOutput& output);
  void Localise(const VioOutput& output);
  void Handle(const VioOutput& output);
  void NoteSaturation(std::span<const ImuSample> imu);
  void PublishPose(const VioOutput& output);
  void PublishKeyframe(const Keyframe& keyframe);
  void WriteTum(const VioOutput& output);
  void OpenTum(const std::string& file);
  void NoteTumFailure();
  std::string Summary() const;
  std::string LagText(int64_t lag_us) const;
  void TellLag(int64_t now_utime);

  VioProcessOptions options_;
  Node node_;
  ReliableKeyframePublisher publisher_;
  std::optional<Vio> vio_;
  ShownPose shown_;
  MapLocalisation localization_;
  MapId shown_map_;
  OptionsAnnouncer announcer_;
  std::optional<int64_t> first_image_utime_;
  std::string state_text_ = "waiting for images";
  std::string why_refused_;  // the newest refused image
  std::string doubt_;        // a warning while tracking
  SaturationDetector saturation_;
  bool saturated_ = false;     // in the samples of the newest image
  int64_t num_saturated_ = 0;  // samples
  PoseCount pose_count_;       // without images that repeat
  int64_t num_repeated_ = 0;   // images
  int64_t num_keyframes_ = 0;
  int64_t lag_us_ = 0;
  int64_t largest_lag_us_ = 0;  // since the last message on stderr
  int64_t num_dropped_ = 0;     // because of the lag
  int64_t num_dropped_told_ = 0;
  int64_t next_lag_told_utime_ = 0;
  std::ofstream tum_;
  std::string tum_file_;
  std::optional<std::string> output_error_;
  std::optional<MapId> tum_map_;
  int tum_files_ = 0;
  std::optional<LogFileWriter> keyframe_log_;
};

}  // namespace pangea::vio
