#pragma once

// Contrast-limited adaptive histogram equalisation (Zuiderveld, Graphics Gems IV, 1994): each tile
// of the image has a table of grey values, and a pixel is interpolated between the tables of the
// four tiles around it. The tables equal OpenCV's; the interpolation is in integers.

#include <array>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

namespace pangea::vio {

class Equaliser {
 public:
  // `clip`: limit of a histogram bin, in multiples of the mean bin.
  explicit Equaliser(double clip) : clip_(clip) {}

  // `image`: grey, 8 bit, at least kTiles x kTiles pixels. The result has its own memory.
  cv::Mat Apply(const cv::Mat& image);

 private:
  static constexpr int kTiles = 8;  // in each direction
  static constexpr int kGreys = 256;
  using Table = std::array<uint8_t, kGreys>;

  Table TableOf(const cv::Mat& tile) const;
  static void Blend(const Table& first, const Table& second, int16_t weight,
                    std::array<int16_t, kGreys>* out);

  double clip_;
  std::array<std::array<Table, kTiles>, kTiles> tables_;  // row, column
};

}  // namespace pangea::vio
