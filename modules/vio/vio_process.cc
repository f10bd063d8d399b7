#include "vio/vio_process.h"

#include <fmt/format.h>

#include <algorithm>
#include <lcm/lcm-cpp.hpp>
#include <stdexcept>

#include "common/channels.h"
#include "common/messages.h"
#include "common/trajectory.h"
#include "pangea/again_t.hpp"
#include "pangea/keyframe_t.hpp"

namespace pangea::vio {
namespace {

constexpr int64_t kStatusInterval_us = 1'000'000;
constexpr size_t kMaxRequesterLength = 40;

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

template <typename Message>
std::vector<uint8_t> Encode(const Message& message) {
  std::vector<uint8_t> bytes(static_cast<size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

bool IsProcessName(const std::string& name) {
  return !name.empty() && name.size() <= kMaxRequesterLength &&
         std::all_of(name.begin(), name.end(),
                     [](unsigned char c) { return std::isalnum(c) != 0 || c == '_'; });
}

}  // namespace

VioProcess::VioProcess(Bus& bus, const VioProcessOptions& options, int64_t now_utime)
    : options_(options),
      node_(bus, fmt::format("vio_{}", options.agent_id)),
      uplink_heard_utime_(now_utime) {
  node_.Subscribe<correction_t>(
      channels::Correction(options_.agent_id),
      [this](const std::string&, const correction_t& message) { OnCorrection(message); });
  node_.Subscribe<have_t>(std::string(channels::kHave),
                          [this](const std::string&, const have_t& message) { OnHave(message); });
  node_.Subscribe<resend_request_t>(
      std::string(channels::kResendRequest),
      [this](const std::string&, const resend_request_t& message) { OnResendRequest(message); });
  if (!options_.out_keyframes.empty()) {
    keyframe_log_ = std::make_unique<lcm::LogFile>(options_.out_keyframes, "w");
    if (!keyframe_log_->good()) {
      throw std::runtime_error(fmt::format("cannot write {}", options_.out_keyframes));
    }
  }
  if (!options_.out_tum.empty()) {
    tum_.open(options_.out_tum);
    if (!tum_) {
      throw std::runtime_error(fmt::format("cannot write {}", options_.out_tum));
    }
  }
}

VioProcess::~VioProcess() = default;

void VioProcess::Open(const CameraModel& camera, const ImuNoise& noise) {
  const auto open_map = [this, opened = int64_t{0}]() mutable {
    return options_.map_utime ? *options_.map_utime + opened++ : WallUtime();
  };
  vio_.emplace(options_.agent_id, camera, noise, options_.vio, open_map);
}

void VioProcess::AddImage(int64_t utime, const cv::Mat& image, std::span<const ImuSample> imu) {
  Handle(vio_->AddImage(utime, image, imu));
}

void VioProcess::AddTracks(const TrackedFrame& frame, const cv::Mat& image,
                           std::span<const ImuSample> imu) {
  Handle(vio_->AddTracks(frame, image, imu));
}

void VioProcess::Handle(const VioOutput& output) {
  if (!first_image_utime_) {
    first_image_utime_ = output.utime;
  }
  const bool tracking = output.state == EstimatorState::kTracking;
  node_.Count("frames");
  node_.Set("maps", vio_->maps_opened());
  node_.Set("tracked", output.num_tracked);
  if (tracking && state_text_ != "tracking") {
    node_.Set("initialised_ms", (output.utime - *first_image_utime_) / 1000);
  }
  state_text_ =
      tracking
          ? "tracking"
          : fmt::format("{}: {}", output.state == EstimatorState::kLost ? "lost" : "initialising",
                        output.reason);
  if (output.state == EstimatorState::kLost) {
    node_.Count("lost");
  }
  PublishPose(output);
  for (const Keyframe& keyframe : output.keyframes) {
    PublishKeyframe(keyframe);
  }
  if (tracking) {
    WriteTum(output);
  }
}

void VioProcess::PublishPose(const VioOutput& output) {
  if (output.map != shown_map_) {
    shown_map_ = output.map;
    shown_.Reset(output.map);
  }
  pose_t message{};
  message.utime = output.utime;
  message.state = ToMessage(output.state);
  message.reason = output.reason;
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
  const std::string channel = channels::Keyframe(options_.agent_id);
  std::vector<uint8_t> bytes = Encode(pangea::ToMessage(keyframe));
  node_.bus().Publish(channel, bytes);
  node_.Count("keyframes");
  node_.Count("keyframe_bytes", static_cast<int64_t>(bytes.size()));
  published_[keyframe.id.map] = keyframe.id.seq + 1;
  if (keyframe_log_) {
    lcm::LogEvent event{};
    event.timestamp = keyframe.utime;
    event.channel = channel;
    event.datalen = static_cast<int32_t>(bytes.size());
    event.data = bytes.data();
    keyframe_log_->writeEvent(&event);
  }
  kept_.push_back({keyframe.id, std::move(bytes)});
  if (kept_.size() > kKeptKeyframes) {
    kept_.pop_front();
  }
}

void VioProcess::WriteTum(const VioOutput& output) {
  if (options_.out_tum.empty()) {
    return;
  }
  if (tum_map_ != output.map) {
    tum_map_ = output.map;
    if (++tum_files_ > 1) {
      tum_.close();
      tum_.open(fmt::format("{}.{}", options_.out_tum, tum_files_));
    }
  }
  tum_ << ToTum({{output.utime, output.T_odom_body}}) << std::flush;
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
  node_.PublishStatus(now_utime, Unacknowledged(), "finished");
}

void VioProcess::Tick(int64_t now_utime) {
  if (uplink_heard_) {
    uplink_heard_utime_ = now_utime;
    uplink_heard_ = false;
  }
  if (now_utime >= next_status_utime_) {
    next_status_utime_ = now_utime + kStatusInterval_us;
    node_.PublishStatus(now_utime, Unacknowledged(), Summary());
  }
}

std::string VioProcess::Summary() const {
  return fmt::format("agent {}: {}", options_.agent_id, state_text_);
}

int64_t VioProcess::Unacknowledged() const {
  int64_t count = 0;
  for (const auto& [map, published] : published_) {
    const auto it = acknowledged_.find(map);
    count += std::max(0, published - (it == acknowledged_.end() ? 0 : it->second));
  }
  return count;
}

void VioProcess::OnCorrection(const correction_t& message) {
  const Parsed<Correction> correction = Parse(message);
  if (!correction.value) {
    node_.Refuse("correction: " + correction.refused);
    return;
  }
  if (shown_.Correct(*correction.value)) {
    node_.Count("corrections");
    vio_->set_group_revision(shown_.revision());
  }
}

void VioProcess::OnHave(const have_t& message) {
  uplink_heard_ = true;
  uplink_ever_heard_ = true;
  for (int i = 0; i < message.num_maps; ++i) {
    const Parsed<MapId> map = Parse(message.maps[static_cast<size_t>(i)]);
    if (map.value && map.value->agent_id == options_.agent_id) {
      int32_t& acknowledged = acknowledged_[*map.value];
      acknowledged = std::max(acknowledged, message.highest_seq[static_cast<size_t>(i)] + 1);
    }
  }
}

void VioProcess::OnResendRequest(const resend_request_t& message) {
  if (message.channel != channels::Keyframe(options_.agent_id)) {
    return;
  }
  const Parsed<MapId> map = Parse(message.map);
  if (!map.value || !IsProcessName(message.requester)) {
    node_.Refuse("resend request: map or requester is malformed");
    return;
  }
  int answers = 0;
  for (const KeptKeyframe& keyframe : kept_) {
    if (keyframe.id.map != *map.value || keyframe.id.seq < message.from_seq ||
        keyframe.id.seq > message.to_seq) {
      continue;
    }
    if (++answers > kMaxAnswers) {
      break;
    }
    again_t again{};
    again.channel = message.channel;
    again.data = keyframe.bytes;
    again.num_bytes = static_cast<int32_t>(again.data.size());
    node_.Publish(channels::Again(message.requester), again);
    node_.Count("resent");
  }
}

}  // namespace pangea::vio
