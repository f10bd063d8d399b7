#include "vio/live/live_input.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <span>
#include <string>
#include <utility>

#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/messages.h"
#include "recording/grey_image.h"

namespace pangea::vio {
namespace {

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
    : process_(process), sensors_(process), noise_(noise) {
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
  // Later messages are ignored: a running odometry refines its calibration itself.
  std::vector<uint8_t> bytes = EncodeMessage(message);
  if (!camera_) {
    camera_ = *camera.value;
    camera_message_ = std::move(bytes);
    process_.Open(*camera_, noise_);
  } else if (bytes != camera_message_) {
    process_.node().Refuse(
        "camera: not as the first one, which is used: restart pangea-vio to use this");
  }
}

void LiveInput::OnImu(const imu_t& message) {
  ImuSample sample;
  sample.utime = message.utime;
  sample.gyro = {message.gyro_body.x, message.gyro_body.y, message.gyro_body.z};
  sample.accel = {message.accel_body.x, message.accel_body.y, message.accel_body.z};
  sensors_.AddImu(sample);
}

bool LiveInput::Plausible(const image_t& message) {
  return message.num_chunks > 0 && message.chunk >= 0 && message.chunk < message.num_chunks &&
         message.total_bytes > 0 && message.total_bytes <= kMaxImageBytes &&
         message.num_bytes >= 0 && message.offset_bytes >= 0 &&
         message.offset_bytes <= message.total_bytes - message.num_bytes;
}

void LiveInput::OnImage(const image_t& message) {
  if (!camera_) {
    return process_.RefuseImage("no CAMERA yet");
  }
  if (message.width != camera_->width || message.height != camera_->height) {
    return process_.RefuseImage(fmt::format("{}x{} pixels instead of {}x{}, as CAMERA says",
                                            message.width, message.height, camera_->width,
                                            camera_->height));
  }
  if (!Plausible(message)) {
    return process_.RefuseImage("chunk does not fit");
  }
  const std::optional<int64_t> newest = sensors_.newest_image();
  if (newest && message.utime <= *newest &&
      message.utime > *newest - SensorInput::kMaxImageStep_us) {
    process_.node().Refuse(
        // a late chunk: its image was already taken or passed over
        "image: not after the last one");
    return;
  }
  if (newest && message.utime > *newest && message.utime < *newest + kMinImageStep_us) {
    return process_.RefuseImage(
        "within a millisecond of the last one: are the stamps in microseconds?");
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

// Returns the image's assembly, creating it if needed; if there are too many, the oldest is
// dropped.
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
  if (!sensors_.TakeImageStamp(utime)) {
    return;
  }
  // The missing chunks of older images would come too late.
  process_.node().NoteDropped(static_cast<int64_t>(
      std::erase_if(assemblies_, [utime](const Assembly& other) { return other.utime < utime; })));
  const GreyImage image = Decode(complete.encoding, complete.bytes, *camera_);
  if (image.pixels.empty()) {
    return process_.RefuseImage(image.why);
  }
  sensors_.AddImage(utime, image.pixels);
}

}  // namespace pangea::vio
