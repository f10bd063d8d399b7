#pragma once

// Numbers as LCM has them in its messages, its logs and its relay's protocol: the highest byte
// first.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace pangea {

inline uint64_t GetBigEndian(const uint8_t* in, size_t num_bytes) {
  uint64_t value = 0;
  for (size_t i = 0; i < num_bytes; ++i) {
    value = value << 8 | in[i];
  }
  return value;
}

// Of the four bytes from there on.
inline uint32_t WordAt(std::span<const uint8_t> bytes, size_t at) {
  return static_cast<uint32_t>(GetBigEndian(bytes.data() + at, sizeof(uint32_t)));
}

inline void PutBigEndian(uint64_t value, size_t num_bytes, std::vector<uint8_t>* out) {
  for (size_t i = num_bytes; i-- > 0;) {
    out->push_back(static_cast<uint8_t>(value >> (8 * i)));
  }
}

}  // namespace pangea
