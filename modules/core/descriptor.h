#pragma once

// What a corner looks like: the descriptor's width, how alike two descriptors of one point are, and
// the scale of the image pyramid. Another descriptor is other numbers here and the code that makes
// it (vio/front_end/describer.cc). Messages: keyframe_t takes any width that its 16-bit byte count
// holds, map_landmark_t has shipped with 32 bytes.

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace pangea {

inline constexpr int kDescriptorBits = 256;
using Descriptor = std::array<uint64_t, kDescriptorBits / 64>;

inline int HammingDistance(const Descriptor& a, const Descriptor& b) {
  int distance = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    distance += std::popcount(a[i] ^ b[i]);
  }
  return distance;
}
inline constexpr int kNoDistance = kDescriptorBits + 1;  // more than any

// Bits by which two descriptors of one point may differ; those of two points differ in about half.
inline constexpr int kSureHamming = 56;       // surely one point
inline constexpr int kAlikeHamming = 64;      // one point, where each match counts
inline constexpr int kCandidateHamming = 72;  // where one pose has to explain most of the matches
inline constexpr int kPredictedHamming = 75;  // at a predicted place

// From octave to octave of the image pyramid.
inline constexpr double kOctaveScale = 1.2;

}  // namespace pangea
