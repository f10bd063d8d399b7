#include "vio/front_end/patch_kernel.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#ifdef __x86_64__
#include <immintrin.h>
#elif defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace pangea::vio {
namespace {

constexpr int kLanes = 8;          // outputs that are computed together
constexpr float kLargest = 127.F;  // activation

}  // namespace

PackedWeights::PackedWeights(const std::vector<int8_t>& weights, int outputs, int length)
    : outputs_(outputs), pairs_((length + 1) / 2) {
  packed_.assign(static_cast<size_t>(outputs) * padded_length(), 0);
  for (int output = 0; output < outputs; ++output) {
    for (int k = 0; k < length; ++k) {
      const int group = output / kLanes, lane = output % kLanes;
      packed_[((static_cast<size_t>(group) * pairs_ + k / 2) * kLanes + lane) * 2 + k % 2] =
          int16_t{weights[static_cast<size_t>(output) * length + k]};
    }
  }
}

#ifdef __SSE2__
namespace {

// The two numbers of a pair, repeated.
int32_t PairAt(const int16_t* in) {
  int32_t both = 0;
  std::memcpy(&both, in, sizeof(both));
  return both;
}

// kLanes sums of four inputs that are `stride` numbers apart: as many as fit in registers.
void MultiplyLanes(const int16_t* weights, int pairs, const int16_t* in, ptrdiff_t stride,
                   int32_t* out, ptrdiff_t out_stride) {
  __m128i sums[PackedWeights::kInputs][2] = {};
  const auto* w = reinterpret_cast<const __m128i*>(weights);
  for (int pair = 0; pair < pairs; ++pair, w += 2) {
    const __m128i first = _mm_loadu_si128(w), second = _mm_loadu_si128(w + 1);
    for (int input = 0; input < PackedWeights::kInputs; ++input) {
      const __m128i x = _mm_set1_epi32(PairAt(in + input * stride + 2 * pair));
      sums[input][0] = _mm_add_epi32(sums[input][0], _mm_madd_epi16(first, x));
      sums[input][1] = _mm_add_epi32(sums[input][1], _mm_madd_epi16(second, x));
    }
  }
  for (int input = 0; input < PackedWeights::kInputs; ++input) {
    auto* const at = reinterpret_cast<__m128i*>(out + input * out_stride);
    _mm_storeu_si128(at, sums[input][0]);
    _mm_storeu_si128(at + 1, sums[input][1]);
  }
}

#ifdef __x86_64__
// The same with vectors twice as long.
[[gnu::target("avx2")]] void MultiplyLanesAvx2(const int16_t* weights, int pairs, const int16_t* in,
                                               ptrdiff_t stride, int32_t* out,
                                               ptrdiff_t out_stride) {
  __m256i sums[PackedWeights::kInputs] = {};
  const auto* w = reinterpret_cast<const __m256i*>(weights);
  for (int pair = 0; pair < pairs; ++pair, ++w) {
    const __m256i both = _mm256_loadu_si256(w);
    for (int input = 0; input < PackedWeights::kInputs; ++input) {
      const __m256i x = _mm256_set1_epi32(PairAt(in + input * stride + 2 * pair));
      sums[input] = _mm256_add_epi32(sums[input], _mm256_madd_epi16(both, x));
    }
  }
  for (int input = 0; input < PackedWeights::kInputs; ++input) {
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(out + input * out_stride), sums[input]);
  }
}
const auto kMultiplyLanes = __builtin_cpu_supports("avx2") ? MultiplyLanesAvx2 : MultiplyLanes;
#else
constexpr auto kMultiplyLanes = MultiplyLanes;
#endif

}  // namespace

void PackedWeights::MultiplyFour(const int16_t* in, int32_t* out) const {
  const int16_t* weights = packed_.data();
  for (int output = 0; output < outputs_; output += kLanes, weights += kLanes * padded_length()) {
    kMultiplyLanes(weights, pairs_, in, padded_length(), out + output, outputs_);
  }
}

void Requantise(const int32_t* sums, const float* scales, const float* offsets, int count,
                int16_t* out) {
  const auto four = [&](int i) {
    const __m128i sum = _mm_loadu_si128(reinterpret_cast<const __m128i*>(sums + i));
    const __m128 value = _mm_add_ps(_mm_mul_ps(_mm_cvtepi32_ps(sum), _mm_loadu_ps(scales + i)),
                                    _mm_loadu_ps(offsets + i));
    return _mm_cvtps_epi32(_mm_min_ps(_mm_max_ps(value, _mm_setzero_ps()), _mm_set1_ps(kLargest)));
  };
  for (int i = 0; i < count; i += kLanes) {
    _mm_storeu_si128(reinterpret_cast<__m128i*>(out + i), _mm_packs_epi32(four(i), four(i + 4)));
  }
}

#else

void PackedWeights::MultiplyFour(const int16_t* in, int32_t* out) const {
  for (int input = 0; input < kInputs; ++input, in += padded_length()) {
    const int16_t* weights = packed_.data();
    for (int output = 0; output < outputs_; output += kLanes) {
      std::array<int32_t, kLanes> sums{};
      for (int pair = 0; pair < pairs_; ++pair, weights += 2 * kLanes) {
        for (int lane = 0; lane < kLanes; ++lane) {
          sums[lane] += weights[2 * lane] * in[2 * pair] + weights[2 * lane + 1] * in[2 * pair + 1];
        }
      }
      out = std::copy(sums.begin(), sums.end(), out);
    }
  }
}

void Requantise(const int32_t* sums, const float* scales, const float* offsets, int count,
                int16_t* out) {
  for (int i = 0; i < count; ++i) {
    const float value = static_cast<float>(sums[i]) * scales[i] + offsets[i];
    out[i] = static_cast<int16_t>(std::nearbyint(std::clamp(value, 0.F, kLargest)));
  }
}

#endif

}  // namespace pangea::vio
