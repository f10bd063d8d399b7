#include "vio/live/sensor_input.h"

#include <algorithm>

namespace pangea::vio {
void SensorInput::AddImu(const ImuSample& sample) {
  if (!IsPlausible(sample)) {
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

bool SensorInput::TakeImageStamp(int64_t utime) {
  return TakeStamp(&image_stamps_, "image: ", utime);
}

// Whether the stamp continues its stream; starts anew if the stream went back in time.
bool SensorInput::TakeStamp(StampCheck* stamps, const std::string& what, int64_t utime) {
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
      process_.node().Refuse(what + "stamp out of range: is it in microseconds?");
      return false;
  }
  return false;
}

void SensorInput::StartAnew() {
  process_.node().NoteDropped(static_cast<int64_t>(images_.size()));
  images_.clear();
  samples_.clear();
  process_.StartAnew();
}

void SensorInput::AddImage(int64_t utime, const cv::Mat& image) {
  images_.emplace_back(utime, image);
  DropStale();
  Deliver();
}

// Drops the oldest images until the lag is within its limit. The odometry is too slow only for
// those whose samples have come.
void SensorInput::DropStale() {
  const int64_t lag_us = Lag();
  int64_t dropped = 0;
  while (images_.size() > kMaxImages || Lag() > VioProcess::kMaxLag_us) {
    if (Ready()) {
      ++dropped;
    } else {
      process_.RefuseImage("its inertial samples have not come within a second");
    }
    images_.pop_front();
  }
  if (dropped > 0) {
    process_.NoteLag(lag_us, dropped);
  }
}

// How far the oldest image is behind the newest.
int64_t SensorInput::Lag() const { return images_.back().first - images_.front().first; }

// Whether the samples reach past the oldest image.
bool SensorInput::Ready() const {
  return !images_.empty() && imu_stamps_.newest() &&
         *imu_stamps_.newest() >= process_.ImuTimeOf(images_.front().first);
}

void SensorInput::Deliver() {
  if (Ready()) {
    process_.node().WorkWhenIdle([this] { return DeliverOne(); });
  }
}

// Returns whether another image is ready.
bool SensorInput::DeliverOne() {
  if (!Ready()) {
    return false;  // StartAnew was called meanwhile
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
