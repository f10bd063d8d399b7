#pragma once

// The arithmetic of the patch network: products of small integers, four inputs at a time.
// Everything is exact or rounds as IEEE 754 says, so each platform gives the same results. On x86
// and in WebAssembly with SSE's instructions, else in plain C++.

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace pangea::vio {

// A matrix of int8 weights, stored for MultiplyFour.
class PackedWeights {
 public:
  static constexpr int kInputs = 4;

  PackedWeights() = default;
  // `weights`: row-major, outputs x length. The number of outputs must be a multiple of 8.
  PackedWeights(const std::vector<int8_t>& weights, int outputs, int length);

  int outputs() const { return outputs_; }
  // Length of an input: that of a row of weights, rounded up to an even number.
  int padded_length() const { return 2 * pairs_; }

  // out[i * outputs() + o] = sum over k of weight(o, k) * in[i * padded_length() + k], for kInputs
  // inputs. The padding of `in` must be zero.
  void MultiplyFour(const int16_t* in, int32_t* out) const;

 private:
  int outputs_ = 0;
  int pairs_ = 0;
  std::vector<int16_t> packed_;  // by eight outputs, then by pair of k; (output, k in pair)
};

// out[i] = round(clamp(sums[i] * scales[i] + offsets[i], 0, 127)). `count`: a multiple of 8.
void Requantise(const int32_t* sums, const float* scales, const float* offsets, int count,
                int16_t* out);

}  // namespace pangea::vio
