#pragma once

// Contrast-limited adaptive histogram equalisation (Zuiderveld, Graphics Gems IV, 1994): each tile
// of the image has a table of grey values, a pixel blends those of the four tiles whose centres are
// around it. The same tables as OpenCV's, blended in integers.

#include <array>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

namespace pangea::vio {

class Equalizer {
 public:
  // `clip`: what a grey value may have of a tile's pixels, in multiples of an even histogram's.
  explicit Equalizer(double clip) : clip_(clip) {}

  // Of a grey image of at least kTiles x kTiles pixels; in its own memory.
  cv::Mat Apply(const cv::Mat& image);

 private:
  static constexpr int kTiles = 8;  // each way
  static constexpr int kGreys = 256;
  using Table = std::array<uint8_t, kGreys>;

  Table TableOf(const cv::Mat& tile) const;
  static void Blend(const Table& first, const Table& second, int16_t weight,
                    std::array<int16_t, kGreys>* out);

  double clip_;
  std::array<std::array<Table, kTiles>, kTiles> tables_;  // row, column
};

}  // namespace pangea::vio
