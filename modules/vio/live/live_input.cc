#include "vio/live/live_input.h"

#include <algorithm>
#include <cstring>
#include <opencv2/imgcodecs.hpp>
#include <utility>

#include "messages/channels.h"
#include "messages/messages.h"

namespace pangea::vio {
namespace {

// Any of these is a broken sensor, not a phone in a hand.
constexpr double kMaxGyro = 100;   // rad/s
constexpr double kMaxAccel = 500;  // m/s^2

}  // namespace

LiveInput::LiveInput(VioProcess& process, int32_t agent_id, const ImuNoise& noise)
    : process_(process), noise_(noise) {
  Node& node = process.node();
  node.Subscribe<camera_t>(
      channels::Camera(agent_id),
      [this](const std::string&, const camera_t& message) { OnCamera(message); });
  node.Subscribe<imu_t>(channels::Imu(agent_id),
                        [this](const std::string&, const imu_t& message) { OnImu(message); });
  node.Subscribe<image_t>(channels::Image(agent_id),
                          [this](const std::string&, const image_t& message) { OnImage(message); });
}

void LiveInput::OnCamera(const camera_t& message) {
  const Parsed<CameraModel> camera = Parse(message);
  if (!camera.value) {
    process_.node().Refuse("camera: " + camera.refused);
    return;
  }
  // The calibration of a running odometry is the odometry's own.
  if (!camera_) {
    camera_ = *camera.value;
    process_.Open(*camera_, noise_);
  }
}

void LiveInput::OnImu(const imu_t& message) {
  ImuSample sample;
  sample.utime = message.utime;
  sample.gyro = {message.gyro_body.x, message.gyro_body.y, message.gyro_body.z};
  sample.accel = {message.accel_body.x, message.accel_body.y, message.accel_body.z};
  if (!sample.gyro.allFinite() || !sample.accel.allFinite() || sample.gyro.norm() > kMaxGyro ||
      sample.accel.norm() > kMaxAccel) {
    process_.node().Refuse("imu: not finite or absurd");
    return;
  }
  if (newest_sample_ && sample.utime <= *newest_sample_) {
    process_.node().Refuse("imu: not after the last sample");
    return;
  }
  newest_sample_ = sample.utime;
  samples_.push_back(sample);
  if (samples_.size() > kMaxSamples) {
    samples_.erase(samples_.begin(), samples_.begin() + kMaxSamples / 2);
    process_.node().NoteDropped(kMaxSamples / 2);
  }
  Deliver();
}

bool LiveInput::Plausible(const image_t& message) const {
  return camera_ && message.width == camera_->width && message.height == camera_->height &&
         message.num_chunks > 0 && message.chunk >= 0 && message.chunk < message.num_chunks &&
         message.total_bytes > 0 && message.total_bytes <= kMaxImageBytes &&
         message.num_bytes >= 0 && message.offset_bytes >= 0 &&
         message.offset_bytes <= message.total_bytes - message.num_bytes;
}

void LiveInput::OnImage(const image_t& message) {
  if (!Plausible(message)) {
    process_.node().Refuse(camera_ ? "image: size or chunk does not fit" : "image: no CAMERA yet");
    return;
  }
  if (newest_image_ && message.utime <= *newest_image_) {
    process_.node().Refuse("image: not after the last one");
    return;
  }
  Assembly& assembly = assemblies_[message.utime];
  if (assembly.have.empty()) {
    assembly.utime = message.utime;
    assembly.encoding = message.encoding;
    assembly.bytes.resize(static_cast<size_t>(message.total_bytes));
    assembly.have.resize(static_cast<size_t>(message.num_chunks), false);
    assembly.missing = assembly.have.size();
  }
  const auto chunk = static_cast<size_t>(message.chunk);
  if (assembly.bytes.size() != static_cast<size_t>(message.total_bytes) ||
      assembly.have.size() != static_cast<size_t>(message.num_chunks) || assembly.have[chunk]) {
    process_.node().Refuse("image: chunk repeated or of another image");
    return;
  }
  std::copy(message.data.begin(), message.data.end(),
            assembly.bytes.begin() + message.offset_bytes);
  assembly.have[chunk] = true;
  if (--assembly.missing == 0) {
    const Assembly complete = std::move(assembly);
    // Older ones have lost a chunk for good.
    const auto end = assemblies_.upper_bound(message.utime);
    process_.node().NoteDropped(std::distance(assemblies_.begin(), end) - 1);
    assemblies_.erase(assemblies_.begin(), end);
    Finish(complete);
  } else if (assemblies_.size() > kMaxImages) {
    assemblies_.erase(assemblies_.begin());
    process_.node().NoteDropped();
  }
}

void LiveInput::Finish(const Assembly& assembly) {
  const cv::Size size(camera_->width, camera_->height);
  cv::Mat image;
  if (assembly.encoding == image_t::ENCODING_RAW8) {
    if (assembly.bytes.size() == static_cast<size_t>(size.area())) {
      image.create(size, CV_8U);
      std::memcpy(image.data, assembly.bytes.data(), assembly.bytes.size());
    }
  } else if (assembly.encoding == image_t::ENCODING_PNG) {
    image = cv::imdecode(assembly.bytes, cv::IMREAD_GRAYSCALE);
  }
  if (image.size() != size) {
    process_.node().Refuse("image: cannot be decoded");
    return;
  }
  newest_image_ = assembly.utime;
  images_.emplace_back(assembly.utime, image);
  if (images_.size() > kMaxImages) {
    images_.pop_front();
    process_.node().NoteDropped();
  }
  Deliver();
}

void LiveInput::Deliver() {
  while (!images_.empty() && newest_sample_ &&
         *newest_sample_ >= process_.ImuTimeOf(images_.front().first)) {
    const auto [utime, image] = images_.front();
    images_.pop_front();
    const int64_t imu_time = process_.ImuTimeOf(utime);
    auto end = std::find_if(samples_.begin(), samples_.end(), [imu_time](const ImuSample& sample) {
      return sample.utime >= imu_time;
    });
    end = end == samples_.end() ? end : std::next(end);
    const std::vector<ImuSample> imu(samples_.begin(), end);
    samples_.erase(samples_.begin(), end);
    process_.AddImage(utime, image, imu);
  }
}

}  // namespace pangea::vio
