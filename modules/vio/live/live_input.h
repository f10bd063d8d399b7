#pragma once

// Live sensors on the agent's bus: CAMERA_k once (repeated as often as the bridge likes), IMU_k,
// and IMAGE_k in chunks. An image goes to the odometry as soon as the inertial samples reach past
// it and no other message waits: so what has come is known, and an odometry that cannot keep up
// drops images instead of falling ever further behind (VioProcess::kMaxLag_us). Bounded: at most
// kMaxAssemblies images wait for their chunks, kMaxImages for their samples or the odometry, and
// kMaxSamples for an image; the oldest go first and are counted as dropped. Stamps that do not go
// on from the ones before are refused and counted (stamp_check.h); where a stream goes back the
// odometry starts anew.

#include <cstdint>
#include <deque>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/camera_model.h"
#include "core/imu/imu.h"
#include "pangea/camera_t.hpp"
#include "pangea/image_t.hpp"
#include "pangea/imu_t.hpp"
#include "vio/live/stamp_check.h"
#include "vio/vio_process.h"

namespace pangea::vio {

class LiveInput {
 public:
  static constexpr size_t kMaxAssemblies = 10;
  static constexpr size_t kMaxImages = 100;
  static constexpr size_t kMaxSamples = 20'000;  // 100 s at 200 Hz
  static constexpr int32_t kMaxImageBytes = 16'000'000;
  // A longer hole in the samples, or in the images, is the end of the map anyway (imu_buffer.cc,
  // estimator.cc).
  static constexpr int64_t kMaxImuStep_us = 300'000;
  static constexpr int64_t kMaxImageStep_us = 1'000'000;

  LiveInput(VioProcess& process, int32_t agent_id, const ImuNoise& noise);

 private:
  // An image whose chunks are still coming.
  struct Assembly {
    int64_t utime = 0;
    int8_t encoding = 0;
    std::vector<uint8_t> bytes;
    std::vector<bool> have;
    size_t missing = 0;
  };

  void OnCamera(const camera_t& message);
  void OnImu(const imu_t& message);
  void OnImage(const image_t& message);
  bool Plausible(const image_t& message) const;
  Assembly& AssemblyOf(const image_t& message);
  void Complete(int64_t utime);
  bool TakeStamp(StampCheck* stamps, const std::string& what, int64_t utime);
  void StartAnew();
  void Finish(const Assembly& assembly);
  bool Ready() const;
  void DropStale();
  int64_t Lag() const;
  void Deliver();
  bool DeliverOne();

  VioProcess& process_;
  ImuNoise noise_;
  std::optional<CameraModel> camera_;
  std::deque<Assembly> assemblies_;  // as they began to come
  std::deque<std::pair<int64_t, cv::Mat>> images_;
  std::vector<ImuSample> samples_;  // not yet seen by the odometry
  StampCheck imu_stamps_{kMaxImuStep_us};
  StampCheck image_stamps_{kMaxImageStep_us};
};

}  // namespace pangea::vio
