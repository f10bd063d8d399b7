#pragma once

// Live sensors on the agent's bus: CAMERA_k once (repeated as often as the bridge likes), IMU_k,
// and IMAGE_k in chunks. An image goes to the odometry as soon as the inertial samples reach past
// it. Bounded: at most kMaxImages wait for their samples and kMaxSamples for an image; the oldest
// go first and are counted as dropped.

#include <cstdint>
#include <deque>
#include <map>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/camera_model.h"
#include "core/imu/imu.h"
#include "pangea/camera_t.hpp"
#include "pangea/image_t.hpp"
#include "pangea/imu_t.hpp"
#include "vio/vio_process.h"

namespace pangea::vio {

class LiveInput {
 public:
  static constexpr size_t kMaxImages = 10;
  static constexpr size_t kMaxSamples = 20'000;  // 100 s at 200 Hz
  static constexpr int32_t kMaxImageBytes = 16'000'000;

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
  void Finish(const Assembly& assembly);
  void Deliver();

  VioProcess& process_;
  ImuNoise noise_;
  std::optional<CameraModel> camera_;
  std::map<int64_t, Assembly> assemblies_;
  std::deque<std::pair<int64_t, cv::Mat>> images_;
  std::vector<ImuSample> samples_;  // not yet seen by the odometry
  std::optional<int64_t> newest_sample_;
  std::optional<int64_t> newest_image_;
};

}  // namespace pangea::vio
