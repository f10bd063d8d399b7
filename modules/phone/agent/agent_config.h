#pragma once

// The configuration of a phone's agent, and how it is parsed from texts.

#include <cstdint>
#include <optional>
#include <string>

#include "core/calibration_sigmas.h"
#include "core/camera_model.h"
#include "core/imu/imu.h"
#include "link/seal.h"
#include "uplink/uplink.h"
#include "vio/vio.h"

namespace pangea::phone {

struct AgentConfig {
  int32_t agent_id = 0;
  int64_t opened_utime = 0;  // of its first map; each further map's is one more
  std::optional<SecretKey> key;
  CameraModel camera;
  std::optional<CalibrationSigmas> sigmas;  // of the camera; nothing: those of `vio`
  ImuNoise imu_noise;
  vio::VioOptions vio;
  bool device_poses = false;  // each image comes with a pose of the device's own odometry
  UplinkOptions uplink;
};

// The same as texts from people and files. An empty text keeps the defaults.
struct AgentTexts {
  double agent = 0;
  double opened_utime = 0;
  std::string key_hex;      // empty: no uplink
  std::string camera_yaml;  // text of a mav0/cam0/sensor.yaml
  std::string imu_yaml;     // text of a mav0/imu0/sensor.yaml; empty: live_imu of the options
  std::string vio_options_yaml;
  std::string uplink_options_yaml;
  bool device_poses = false;
};

// Throws std::runtime_error with the field and advice.
AgentConfig ReadAgentConfig(const AgentTexts& texts);

}  // namespace pangea::phone
