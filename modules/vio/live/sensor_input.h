#pragma once

// Images and inertial samples of live sensors, on their way into the odometry. An image goes there
// as soon as the samples reach past it and no other message waits: so what has come is known, and
// an odometry that cannot keep up drops images instead of falling ever further behind
// (VioProcess::kMaxLag_us). Bounded: at most kMaxImages wait for their samples or the odometry, and
// kMaxSamples for an image; the oldest go first and are counted as dropped. Stamps that do not go
// on from the ones before are refused and counted (stamp_check.h); where a stream goes back the
// odometry starts anew.

#include <cstdint>
#include <deque>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/imu/imu.h"
#include "vio/live/stamp_check.h"
#include "vio/vio_process.h"

namespace pangea::vio {

class SensorInput {
 public:
  static constexpr size_t kMaxImages = 100;
  static constexpr size_t kMaxSamples = 20'000;  // 100 s at 200 Hz
  // A longer hole in the samples, or in the images, is the end of the map anyway (imu_buffer.cc,
  // estimator.cc).
  static constexpr int64_t kMaxImuStep_us = 300'000;
  static constexpr int64_t kMaxImageStep_us = 1'000'000;

  explicit SensorInput(VioProcess& process) : process_(process) {}

  void AddImu(const ImuSample& sample);
  // Whether there is to be an image of this time, in two steps: who decodes need not do it in vain.
  bool TakeImageStamp(int64_t utime);
  // After TakeImageStamp, of the calibration's size; the pixels are not copied.
  void AddImage(int64_t utime, const cv::Mat& image);
  // What waits is of a time that is over: the odometry finishes its map, and opens another.
  void StartAnew();

  std::optional<int64_t> newest_image() const { return image_stamps_.newest(); }

 private:
  bool TakeStamp(StampCheck* stamps, const std::string& what, int64_t utime);
  bool Ready() const;
  void DropStale();
  int64_t Lag() const;
  void Deliver();
  bool DeliverOne();

  VioProcess& process_;
  std::deque<std::pair<int64_t, cv::Mat>> images_;
  std::vector<ImuSample> samples_;  // not yet seen by the odometry
  StampCheck imu_stamps_{kMaxImuStep_us};
  StampCheck image_stamps_{kMaxImageStep_us};
};

}  // namespace pangea::vio
