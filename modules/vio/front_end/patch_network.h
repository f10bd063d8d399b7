#pragma once

// A convolutional network that describes the patch around a corner in 256 bits. Its weights are
// trained by modules/vio/descriptor_training and are part of the program.
//
// The patch of kPatchSide x kPatchSide grey values is normalised to zero mean and unit standard
// deviation, so neither brightness nor contrast count. Three convolutions (3x3, stride 2, ReLU) and
// one linear layer follow; each bit is the sign of one output. Trained so that the descriptors of
// one point in two views have a small Hamming distance and those of others a large one
// (Mishchuk et al., NeurIPS 2017, with a softmax over the negatives of a batch in place of the
// hardest one).
//
// All sums are of integers (weights and activations have 8 bits; Jacob et al., CVPR 2018), so each
// platform gives the same bits.

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/descriptor.h"
#include "vio/front_end/patch_kernel.h"

namespace pangea::vio {

class PatchNetwork {
 public:
  static constexpr int kPatchSide = 32;
  static constexpr int kPatchPixels = kPatchSide * kPatchSide;
  static constexpr int kLayers = 3;
  using Patch = std::array<uint8_t, kPatchPixels>;

  // The weights that are part of the program.
  static const PatchNetwork& BuiltIn();

  // `bytes`: a weights file. Throws std::runtime_error, which names `file`, the field, and the
  // mend, if it is damaged or of another version.
  PatchNetwork(std::span<const uint8_t> bytes, const std::string& file);

  std::vector<Descriptor> Describe(std::span<const Patch> patches) const;

 private:
  // A 3x3 convolution with stride 2. Inputs and outputs are rows of pixels of channels.
  struct Convolution {
    int in_side = 0;
    int in_channels = 0;
    PackedWeights weights;  // a row is (dy, dx, channel)
    std::vector<float> scales, offsets;

    int out_side() const { return in_side / 2; }
    void Apply(const std::vector<int16_t>& in, std::vector<int16_t>* out) const;
  };

  std::array<Convolution, kLayers> convolutions_;
  PackedWeights linear_;
  std::array<int32_t, kDescriptorBits> thresholds_{};  // a bit is set if the sum is at least this
};

}  // namespace pangea::vio
