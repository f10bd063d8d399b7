#pragma once

// Big-endian integers (highest byte first), as LCM uses them in messages, in logs and in the
// protocol of its relay. The caller makes sure that the bytes are there.

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

// The 32-bit number in the four bytes from index `at` on.
inline uint32_t WordAt(std::span<const uint8_t> bytes, size_t at) {
  return static_cast<uint32_t>(GetBigEndian(bytes.data() + at, sizeof(uint32_t)));
}

inline void PutBigEndian(uint64_t value, size_t num_bytes, std::vector<uint8_t>* out) {
  for (size_t i = num_bytes; i-- > 0;) {
    out->push_back(static_cast<uint8_t>(value >> (8 * i)));
  }
}

}  // namespace pangea
