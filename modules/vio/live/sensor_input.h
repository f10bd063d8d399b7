#pragma once

// Buffers images and inertial samples of live sensors for the odometry. An image is passed on as
// soon as the samples reach past it and no other message waits on the bus. So all received images
// are known, and an odometry that cannot keep up drops images instead of falling further and
// further behind (VioProcess::kMaxLag_us). At most kMaxImages images and kMaxSamples samples wait;
// beyond that, the oldest are dropped and counted. Stamps that do not continue the stream are
// refused and counted (stamp_check.h); if a stream goes back in time, the odometry starts anew.

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
  // A longer gap in the samples, or in the images, ends the map anyway (imu_buffer.cc,
  // estimator.cc).
  static constexpr int64_t kMaxImuStep_us = 300'000;
  static constexpr int64_t kMaxImageStep_us = 1'000'000;

  explicit SensorInput(VioProcess& process) : process_(process) {}

  void AddImu(const ImuSample& sample);
  // Checks and accepts the stamp of an image. A separate step, so that an image is decoded only if
  // its stamp is accepted.
  bool TakeImageStamp(int64_t utime);
  // Call after TakeImageStamp. The image has the size in the calibration; its pixels are not
  // copied.
  void AddImage(int64_t utime, const cv::Mat& image);
  // Drops everything that waits; the odometry finishes its map and opens another.
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
