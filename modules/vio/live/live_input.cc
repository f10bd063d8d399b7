#include "vio/live/live_input.h"

#include <algorithm>
#include <cstring>
#include <span>
#include <string>
#include <utility>

#include "messages/channels.h"
#include "messages/messages.h"
#include "recording/grey_image.h"

namespace pangea::vio {
namespace {

// Any of these is a broken sensor, not a phone in a hand.
constexpr double kMaxGyro = 100;   // rad/s
constexpr double kMaxAccel = 500;  // m/s^2

GreyImage Decode(int8_t encoding, std::span<const uint8_t> bytes, const CameraModel& camera) {
  const cv::Size size(camera.width, camera.height);
  if (encoding == image_t::ENCODING_PNG) {
    return DecodeGrey(bytes, size);
  }
  if (encoding != image_t::ENCODING_RAW8) {
    return {{}, "unknown encoding", {}};
  }
  if (bytes.size() != static_cast<size_t>(size.area())) {
    return {{}, "not one byte for each pixel", {}};
  }
  GreyImage image{cv::Mat(size, CV_8U), "", size};
  std::memcpy(image.pixels.data, bytes.data(), bytes.size());
  return image;
}

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
  if (!TakeStamp(&imu_stamps_, "imu: ", sample.utime)) {
    return;
  }
  samples_.push_back(sample);
  if (samples_.size() > kMaxSamples) {
    samples_.erase(samples_.begin(), samples_.begin() + kMaxSamples / 2);
    process_.node().NoteDropped(kMaxSamples / 2);
  }
  Deliver();
}

// Whether it is the stream's, which may go on from an earlier time than before.
bool LiveInput::TakeStamp(StampCheck* stamps, const std::string& what, int64_t utime) {
  switch (stamps->Check(utime)) {
    case StampCheck::Decision::kNext:
      return true;
    case StampCheck::Decision::kWentBack:
      StartAnew();
      return true;
    case StampCheck::Decision::kNotAfter:
      process_.node().Refuse(what + "not after the last one");
      return false;
    case StampCheck::Decision::kFarAhead:
      process_.node().Refuse(what + "far ahead of the last one");
      return false;
    case StampCheck::Decision::kOutOfRange:
      process_.node().Refuse(what + "stamp out of range");
      return false;
  }
  return false;
}

// What waits is of a time that is over.
void LiveInput::StartAnew() {
  process_.node().NoteDropped(static_cast<int64_t>(images_.size()));
  images_.clear();
  samples_.clear();
  process_.StartAnew();
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
  const std::optional<int64_t>& newest = image_stamps_.newest();
  if (newest && message.utime <= *newest && message.utime > *newest - kMaxImageStep_us) {
    process_.node().Refuse(
        "image: not after the last one");  // a late chunk; no image is made of it
    return;
  }
  Assembly& assembly = AssemblyOf(message);
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
    Complete(message.utime);
  }
}

// Begun with its first chunk; of too many the one that was begun first goes.
LiveInput::Assembly& LiveInput::AssemblyOf(const image_t& message) {
  const auto begun = std::ranges::find(assemblies_, message.utime, &Assembly::utime);
  if (begun != assemblies_.end()) {
    return *begun;
  }
  if (assemblies_.size() == kMaxAssemblies) {
    assemblies_.pop_front();
    process_.node().NoteDropped();
  }
  Assembly& assembly = assemblies_.emplace_back();
  assembly.utime = message.utime;
  assembly.encoding = message.encoding;
  assembly.bytes.resize(static_cast<size_t>(message.total_bytes));
  assembly.have.resize(static_cast<size_t>(message.num_chunks), false);
  assembly.missing = assembly.have.size();
  return assembly;
}

void LiveInput::Complete(int64_t utime) {
  const auto found = std::ranges::find(assemblies_, utime, &Assembly::utime);
  const Assembly complete = std::move(*found);
  assemblies_.erase(found);
  if (!TakeStamp(&image_stamps_, "image: ", utime)) {
    return;
  }
  // Older ones have lost a chunk for good.
  process_.node().NoteDropped(static_cast<int64_t>(
      std::erase_if(assemblies_, [utime](const Assembly& other) { return other.utime < utime; })));
  Finish(complete);
}

void LiveInput::Finish(const Assembly& assembly) {
  const GreyImage image = Decode(assembly.encoding, assembly.bytes, *camera_);
  if (image.pixels.empty()) {
    process_.node().Refuse("image: " + image.why);
    return;
  }
  images_.emplace_back(assembly.utime, image.pixels);
  DropStale();
  Deliver();
}

// The oldest, until the rest is no further behind the newest than an odometry may be.
void LiveInput::DropStale() {
  int64_t dropped = 0;
  while (images_.size() > kMaxImages || Lag() > VioProcess::kMaxLag_us) {
    images_.pop_front();
    ++dropped;
  }
  if (dropped > 0) {
    process_.NoteLag(Lag(), dropped);
  }
}

// How far the oldest image is behind the newest.
int64_t LiveInput::Lag() const { return images_.back().first - images_.front().first; }

// Whether the samples reach past the oldest image.
bool LiveInput::Ready() const {
  return !images_.empty() && imu_stamps_.newest() &&
         *imu_stamps_.newest() >= process_.ImuTimeOf(images_.front().first);
}

void LiveInput::Deliver() {
  if (Ready()) {
    process_.node().WorkWhenIdle([this] { return DeliverOne(); });
  }
}

// Whether another one is ready.
bool LiveInput::DeliverOne() {
  if (!Ready()) {
    return false;  // the time began anew meanwhile
  }
  process_.NoteLag(Lag(), 0);
  const auto [utime, image] = images_.front();
  images_.pop_front();
  const int64_t imu_time = process_.ImuTimeOf(utime);
  auto end = std::find_if(samples_.begin(), samples_.end(),
                          [imu_time](const ImuSample& sample) { return sample.utime >= imu_time; });
  end = end == samples_.end() ? end : std::next(end);
  const std::vector<ImuSample> imu(samples_.begin(), end);
  samples_.erase(samples_.begin(), end);
  process_.AddImage(utime, image, imu);
  return Ready();
}

}  // namespace pangea::vio
