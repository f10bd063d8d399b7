#pragma once

// Random bytes as keyframes for tests of the link. The same id gives the same bytes.

#include <algorithm>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "core/bytes.h"
#include "core/ids.h"

namespace pangea {

inline const MapId kMap{1, 1000};
inline const MapId kLaterMap{1, 2000};

inline std::vector<uint8_t> Content(const KeyframeId& id) {
  std::mt19937_64 rng(StableHash(id, id, 0));
  std::vector<uint8_t> bytes(5'000 + rng() % 35'000);
  for (uint8_t& byte : bytes) {
    byte = static_cast<uint8_t>(rng());
  }
  return bytes;
}

inline std::string CheckContent(const KeyframeId& id, Bytes bytes) {
  const auto expected = Content(id);
  return std::equal(bytes.begin(), bytes.end(), expected.begin(), expected.end()) ? "" : "wrong";
}

}  // namespace pangea
