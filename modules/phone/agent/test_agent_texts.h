#pragma once

// The configuration of an agent with a small camera, for tests.

#include <cstdint>

#include "phone/agent/agent_config.h"

namespace pangea::phone {

inline constexpr int64_t kStart_us = 1'700'000'000'000'000;
inline constexpr char kKeyHex[] =
    "000102030405060708090a0b0c0d0e0f101112131415161718191a1b1c1d1e1f";

inline AgentTexts Texts() {
  AgentTexts texts;
  texts.agent = 7;
  texts.opened_utime = kStart_us;
  texts.key_hex = kKeyHex;
  texts.camera_yaml =
      "T_BS: {rows: 4, cols: 4, data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}\n"
      "resolution: [64, 48]\nintrinsics: [50, 50, 31.5, 23.5]\n"
      "distortion_model: radtan\ndistortion_coefficients: [0, 0, 0, 0]\n";
  return texts;
}

}  // namespace pangea::phone
