#pragma once

// Receives live sensors from the agent's bus: CAMERA_k (only the first one is used), IMU_k, and
// IMAGE_k in chunks; passes them to sensor_input.h. At most kMaxAssemblies images wait for their
// chunks; beyond that, the oldest is dropped and counted.

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "core/camera_model.h"
#include "core/imu/imu.h"
#include "pangea/camera_t.hpp"
#include "pangea/image_t.hpp"
#include "pangea/imu_t.hpp"
#include "vio/live/sensor_input.h"
#include "vio/vio_process.h"

namespace pangea::vio {

class LiveInput {
 public:
  static constexpr size_t kMaxAssemblies = 10;
  static constexpr int32_t kMaxImageBytes = 16'000'000;
  static constexpr int64_t kMinImageStep_us = 1'000;  // no camera is as fast

  LiveInput(VioProcess& process, int32_t agent_id, const ImuNoise& noise);

 private:
  // An image of which some chunks have not arrived.
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
  static bool Plausible(const image_t& message);
  Assembly& AssemblyOf(const image_t& message);
  void Complete(int64_t utime);

  VioProcess& process_;
  SensorInput sensors_;
  ImuNoise noise_;
  std::optional<CameraModel> camera_;
  std::vector<uint8_t> camera_message_;  // of camera_, encoded
  std::deque<Assembly> assemblies_;      // in order of their first chunk
};

}  // namespace pangea::vio
