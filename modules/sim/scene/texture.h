#pragma once

// Grey textures with box-filtered mip levels. Sampling removes detail finer than a pixel:
// trilinear, with up to four samples along the longer axis of the pixel's footprint.

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace pangea::sim {

// The area that one pixel covers on a surface, in the surface's own coordinates, metres.
struct Footprint {
  float u = 0, v = 0;              // centre
  float major_u = 1, major_v = 0;  // unit direction of the longer axis
  float major = 0, minor = 0;      // lengths of the axes
};

class Texture {
 public:
  Texture() = default;
  // `image` is 8-bit grey. If `repeat`, its sides must be powers of two.
  Texture(const cv::Mat& image, float texel_m, bool repeat);

  // Mean grey over the footprint, 0 .. 255.
  float Sample(const Footprint& footprint) const;

 private:
  struct Level {
    int width = 0, height = 0;
    std::vector<uint8_t> texels;
  };
  float Bilinear(const Level& level, float x, float y) const;

  std::vector<Level> levels_;
  float texels_per_m_ = 1;
  bool repeat_ = false;
};

}  // namespace pangea::sim
