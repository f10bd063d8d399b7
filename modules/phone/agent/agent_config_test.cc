#include "phone/agent/agent_config.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <string>

#include "phone/agent/test_agent_texts.h"

namespace pangea::phone {
namespace {

std::string RefusedFor(const AgentTexts& texts) {
  try {
    ReadAgentConfig(texts);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

TEST(AgentConfigTest, WhatIsWrongIsNamed) {
  EXPECT_EQ(RefusedFor(Texts()), "");
  AgentTexts texts = Texts();
  texts.agent = 0;
  EXPECT_EQ(RefusedFor(texts), "agent: a whole number from 1 to 65535, not 0");
  texts = Texts();
  texts.opened_utime = std::nan("");
  EXPECT_TRUE(RefusedFor(texts).starts_with("openedUtime: a whole number"));
  texts = Texts();
  texts.key_hex.back() = 'x';
  EXPECT_EQ(RefusedFor(texts), "keyHex: must be 64 hexadecimal digits");
  texts = Texts();
  texts.camera_yaml = "resolution: [64, 48]";
  EXPECT_TRUE(RefusedFor(texts).starts_with("cameraYaml: "));
  texts = Texts();
  texts.vio_options_yaml = "tracker: {max_feature: 3}";
  EXPECT_NE(RefusedFor(texts).find("vioOptionsYaml"), std::string::npos);
}

TEST(AgentConfigTest, WithoutImuYamlTheOptionsNoiseCounts) {
  AgentTexts texts = Texts();
  texts.vio_options_yaml = "live_imu: {gyro_noise_density: 0.5}";
  EXPECT_EQ(ReadAgentConfig(texts).imu_noise.gyro_noise_density, 0.5);
  texts.imu_yaml =
      "T_BS: {rows: 4, cols: 4, data: [1, 0, 0, 2, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}\n"
      "gyroscope_noise_density: 0.25\ngyroscope_random_walk: 1\naccelerometer_noise_density: 1\n"
      "accelerometer_random_walk: 1\nrate_hz: 100\n";
  const AgentConfig config = ReadAgentConfig(texts);
  EXPECT_EQ(config.imu_noise.gyro_noise_density, 0.25);
  EXPECT_EQ(config.camera.T_body_cam.t.x(), -2);
}

}  // namespace
}  // namespace pangea::phone
