#include "phone/agent/agent_config.h"

#include <fmt/format.h>
#include <sodium.h>

#include <array>
#include <cmath>
#include <stdexcept>

#include "options/yaml_options.h"
#include "recording/euroc_calibration.h"
#include "vio/vio_file_options.h"

namespace pangea::phone {
namespace {

constexpr double kMaxAgent = 65535;
constexpr double kMaxUtime = 9e15;  // a double represents all integers up to here

int64_t WholeNumber(const char* field, double value, double max) {
  if (!(value >= 1 && value <= max) || value != std::floor(value)) {
    throw std::runtime_error(
        fmt::format("{}: a whole number from 1 to {:.0f}, not {}", field, max, value));
  }
  return static_cast<int64_t>(value);
}

SecretKey KeyFromHex(const std::string& hex) {
  std::array<uint8_t, SecretKey::kBytes> bytes{};
  if (hex.size() != 2 * bytes.size() ||
      sodium_hex2bin(bytes.data(), bytes.size(), hex.data(), hex.size(), nullptr, nullptr,
                     nullptr) != 0) {
    throw std::runtime_error(
        fmt::format("keyHex: must be {} hexadecimal digits", 2 * bytes.size()));
  }
  SecretKey key(bytes);
  sodium_memzero(bytes.data(), bytes.size());
  return key;
}

template <typename Options>
void ReadOptions(const std::string& text, const std::string& name, Options* options) {
  if (!text.empty()) {
    YamlOptions yaml;
    options->Visit(yaml);
    yaml.ReadText(text, name);
  }
}

}  // namespace

AgentConfig ReadAgentConfig(const AgentTexts& texts) {
  AgentConfig config;
  config.agent_id = static_cast<int32_t>(WholeNumber("agent", texts.agent, kMaxAgent));
  config.opened_utime = WholeNumber("openedUtime", texts.opened_utime, kMaxUtime);
  if (!texts.key_hex.empty()) {
    config.key = KeyFromHex(texts.key_hex);
  }
  vio::VioFileOptions vio_options;
  ReadOptions(texts.vio_options_yaml, "vioOptionsYaml", &vio_options);
  config.vio = vio_options.vio;
  config.device_poses = texts.device_poses;
  config.imu_noise = vio_options.live_imu;
  ReadOptions(texts.uplink_options_yaml, "uplinkOptionsYaml", &config.uplink);
  if (const auto invalid = config.uplink.Invalid()) {
    throw std::runtime_error("uplinkOptionsYaml: " + *invalid);
  }
  config.camera = ParseEurocCamera(texts.camera_yaml, "cameraYaml");
  config.sigmas = ParseEurocCalibrationSigmas(texts.camera_yaml, "cameraYaml");
  if (!texts.imu_yaml.empty()) {
    const EurocImuCalibration imu = ParseEurocImuCalibration(texts.imu_yaml, "imuYaml");
    config.imu_noise = imu.noise;
    config.camera.T_body_cam = imu.T_s_body.Inverse() * config.camera.T_body_cam;
  }
  return config;
}

}  // namespace pangea::phone
