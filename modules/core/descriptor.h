#pragma once

// Binary descriptors of corners: their kinds, width, the distances between two descriptors of one
// point, and the scale of the image pyramid. To use another descriptor, add a kind here and the
// code that computes it (vio/front_end/describer.cc). In messages, keyframe_t allows any width that
// its 16-bit byte count holds; map_landmark_t is fixed at 32 bytes.

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace pangea {

inline constexpr int kDescriptorBits = 256;
using Descriptor = std::array<uint64_t, kDescriptorBits / 64>;

// How a keyframe's corners and blobs are described. Descriptors of different kinds say nothing
// about each other, so they are never compared.
enum class DescriptorKind : int8_t {
  kOrb = 0,           // OpenCV's ORB, oriented by the intensity centroid; blobs: gradients
  kPatchNetwork = 1,  // vio/front_end/patch_network.h, oriented by gravity
};
inline constexpr int kNumDescriptorKinds = 2;

inline int HammingDistance(const Descriptor& a, const Descriptor& b) {
  int distance = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    distance += std::popcount(a[i] ^ b[i]);
  }
  return distance;
}
inline constexpr int kNoDistance = kDescriptorBits + 1;  // larger than any distance

// Largest Hamming distances, in bits, at which two corners may be one point. Descriptors of
// different points differ in about half of their bits, but more or less widely: 64 bits of ORB are
// as rare among them as 84 of the network (docs/decisions/descriptor.md).
struct HammingLimits {
  int sure;       // the two corners are surely one point
  int alike;      // each single match counts
  int candidate;  // one pose has to explain most of the matches
  int predicted;  // the corner is searched at a predicted place
};
inline constexpr HammingLimits LimitsOf(DescriptorKind kind) {
  return kind == DescriptorKind::kOrb ? HammingLimits{56, 64, 72, 75}
                                      : HammingLimits{74, 80, 86, 88};
}

// Scale factor between two neighbouring octaves of the image pyramid.
inline constexpr double kOctaveScale = 1.2;

}  // namespace pangea
