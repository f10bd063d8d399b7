#pragma once

// Binary descriptors of corners: their width, the distances between two descriptors of one point,
// and the scale of the image pyramid. To use another descriptor, change the numbers here and the
// code that computes it (vio/front_end/describer.cc). In messages, keyframe_t allows any width that
// its 16-bit byte count holds; map_landmark_t is fixed at 32 bytes.

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
inline constexpr int kNoDistance = kDescriptorBits + 1;  // larger than any distance

// Largest Hamming distances, in bits, at which two corners may be one point. Descriptors of
// different points differ in about half of their bits.
inline constexpr int kSureHamming = 56;       // the two corners are surely one point
inline constexpr int kAlikeHamming = 64;      // each single match counts
inline constexpr int kCandidateHamming = 72;  // one pose has to explain most of the matches
inline constexpr int kPredictedHamming = 75;  // the corner is searched at a predicted place

// Scale factor between two neighbouring octaves of the image pyramid.
inline constexpr double kOctaveScale = 1.2;

}  // namespace pangea
