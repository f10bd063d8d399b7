#include "sim/scene/texture.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace pangea::sim {
namespace {

// log2 to within 0.01: the exponent, and a parabola over the mantissa.
float FastLog2(float x) {
  const auto bits = std::bit_cast<uint32_t>(x);
  const auto exponent = static_cast<float>(static_cast<int>(bits >> 23) - 127);
  const float m = std::bit_cast<float>((bits & 0x007FFFFFu) | 0x3F800000u);
  return exponent + (-0.33333333f * m + 2.0f) * m - 1.66666666f;
}

int FloorInt(float x) {
  const int i = static_cast<int>(x);
  return i - (x < static_cast<float>(i) ? 1 : 0);
}

}  // namespace

Texture::Texture(const cv::Mat& image, float texel_m, bool repeat)
    : texels_per_m_(1.0f / texel_m), repeat_(repeat) {
  Level base{image.cols, image.rows, {}};
  for (int y = 0; y < image.rows; ++y) {
    base.texels.insert(base.texels.end(), image.ptr(y), image.ptr(y) + image.cols);
  }
  levels_.push_back(std::move(base));
  while (levels_.back().width > 1 || levels_.back().height > 1) {
    const Level& fine = levels_.back();
    Level coarse{std::max(1, fine.width / 2), std::max(1, fine.height / 2), {}};
    coarse.texels.resize(static_cast<size_t>(coarse.width) * static_cast<size_t>(coarse.height));
    for (int y = 0; y < coarse.height; ++y) {
      const int y1 = std::min(2 * y + 1, fine.height - 1);
      const uint8_t* a = &fine.texels[static_cast<size_t>(2 * y) * static_cast<size_t>(fine.width)];
      const uint8_t* b = &fine.texels[static_cast<size_t>(y1) * static_cast<size_t>(fine.width)];
      uint8_t* out = &coarse.texels[static_cast<size_t>(y) * static_cast<size_t>(coarse.width)];
      for (int x = 0; x < coarse.width; ++x) {
        const int x1 = std::min(2 * x + 1, fine.width - 1);
        out[x] = static_cast<uint8_t>((a[2 * x] + a[x1] + b[2 * x] + b[x1] + 2) / 4);
      }
    }
    levels_.push_back(std::move(coarse));
  }
}

inline float Texture::Bilinear(const Level& level, float x, float y) const {
  const int ix = FloorInt(x);
  const int iy = FloorInt(y);
  const float fx = x - static_cast<float>(ix);
  const float fy = y - static_cast<float>(iy);
  int x0, x1, y0, y1;
  if (repeat_) {
    x0 = ix & (level.width - 1);
    x1 = (ix + 1) & (level.width - 1);
    y0 = iy & (level.height - 1);
    y1 = (iy + 1) & (level.height - 1);
  } else {
    x0 = std::clamp(ix, 0, level.width - 1);
    x1 = std::clamp(ix + 1, 0, level.width - 1);
    y0 = std::clamp(iy, 0, level.height - 1);
    y1 = std::clamp(iy + 1, 0, level.height - 1);
  }
  const uint8_t* a =
      level.texels.data() + static_cast<size_t>(y0) * static_cast<size_t>(level.width);
  const uint8_t* b =
      level.texels.data() + static_cast<size_t>(y1) * static_cast<size_t>(level.width);
  const float top = static_cast<float>(a[x0]) + fx * static_cast<float>(a[x1] - a[x0]);
  const float bottom = static_cast<float>(b[x0]) + fx * static_cast<float>(b[x1] - b[x0]);
  return top + fy * (bottom - top);
}

float Texture::Sample(const Footprint& f) const {
  constexpr float kMaxTaps = 4;
  // Taps are up to one and a half pixels apart.
  const float wanted = std::clamp(0.67f * f.major / f.minor + 0.5f, 1.0f, kMaxTaps);
  const int taps = static_cast<int>(wanted);
  const float size = std::max(f.minor, f.major / static_cast<float>(taps));
  const float lod = std::clamp(FastLog2(std::max(size * texels_per_m_, 1.0f)), 0.0f,
                               static_cast<float>(levels_.size() - 1));
  const int fine = static_cast<int>(lod);
  // Blends levels only near the middle between two: most look-ups need a single level.
  const float fraction = lod - static_cast<float>(fine);
  const float blend = std::clamp(2.5f * (fraction - 0.3f), 0.0f, 1.0f);
  const Level& a = levels_[static_cast<size_t>(fine)];
  const Level& b = levels_[std::min(static_cast<size_t>(fine) + 1, levels_.size() - 1)];
  const float scale = texels_per_m_ / static_cast<float>(1 << fine);
  const float step = f.major / static_cast<float>(taps);
  float sum = 0;
  for (int i = 0; i < taps; ++i) {
    const float s = (static_cast<float>(i) + 0.5f - 0.5f * static_cast<float>(taps)) * step;
    const float x = (f.u + s * f.major_u) * scale;
    const float y = (f.v + s * f.major_v) * scale;
    if (blend < 1) {
      sum += (1 - blend) * Bilinear(a, x - 0.5f, y - 0.5f);
    }
    if (blend > 0) {
      sum += blend * Bilinear(b, 0.5f * x - 0.5f, 0.5f * y - 0.5f);
    }
  }
  return sum / static_cast<float>(taps);
}

}  // namespace pangea::sim
