#include "vio/front_end/equaliser.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <opencv2/core/hal/intrin.hpp>
#include <span>

#include "vio/vector_clones.h"

namespace pangea::vio {
namespace {

constexpr int kOne = 128;  // stands for a weight of 1; a grey value times it fits 16 bits

// The rows (or columns) between the centres of two neighbouring tiles; beyond the outermost centre
// there is one tile only.
struct Strip {
  int begin = 0, end = 0;
  int first = 0, second = 0;  // the tiles that are blended
};

std::vector<Strip> StripsOf(int size, int tiles) {
  std::vector<Strip> strips;
  for (int k = 0; k <= tiles; ++k) {
    const auto centre = [&](int tile) {  // the first pixel at or after it
      return ((2 * tile + 1) * size + 2 * tiles - 1) / (2 * tiles);
    };
    strips.push_back({k == 0 ? 0 : centre(k - 1), k == tiles ? size : centre(k), std::max(k - 1, 0),
                      std::min(k, tiles - 1)});
  }
  return strips;
}

// Weight of the second tile.
int16_t WeightAt(int i, int size, int tiles) {
  const float at = static_cast<float>(i * tiles) / static_cast<float>(size) + 0.5F;
  return static_cast<int16_t>(cvRound(kOne * (at - std::floor(at))));
}

// For each pixel: the two values of its grey value.
void LookUp(const int16_t* pairs, const uint8_t* grey, int count, int16_t* out) {
  for (int i = 0; i < count; ++i) {
    std::memcpy(out + 2 * i, pairs + 2 * grey[i], 2 * sizeof(int16_t));
  }
}

// Interleaves two tables: a grey value's two values are neighbours.
PANGEA_VECTOR_CLONES
void Interleave(std::span<const int16_t> first, std::span<const int16_t> second,
                std::span<int16_t> out) {
  for (size_t grey = 0; grey < first.size(); ++grey) {
    out[2 * grey] = first[grey];
    out[2 * grey + 1] = second[grey];
  }
}

// For each pixel: the weighted sum of its two values.
PANGEA_VECTOR_CLONES
void BlendRow(const std::vector<int16_t>& values, const std::vector<int16_t>& weights,
              uint8_t* out) {
  constexpr int kShift = 14, kHalf = kOne * kOne / 2;
  static_assert(1 << kShift == kOne * kOne);
  const size_t width = values.size() / 2;
  const auto sums = [&](size_t x) {  // sums of four pixels
    const cv::v_int32x4 sum =
        cv::v_dotprod(cv::v_load(&values[2 * x]), cv::v_load(&weights[2 * x]));
    return (sum + cv::v_setall_s32(kHalf)) >> kShift;
  };
  size_t x = 0;
  for (; x + 16 <= width; x += 16) {
    cv::v_store(out + x, cv::v_pack_u(cv::v_pack(sums(x), sums(x + 4)),
                                      cv::v_pack(sums(x + 8), sums(x + 12))));
  }
  for (; x < width; ++x) {
    const int sum = weights[2 * x] * values[2 * x] + weights[2 * x + 1] * values[2 * x + 1];
    out[x] = static_cast<uint8_t>((sum + kHalf) >> kShift);
  }
}

}  // namespace

Equaliser::Table Equaliser::TableOf(const cv::Mat& tile) const {
  // Two histograms: neighbours are often equal, and a count must be written before it is read
  // again.
  std::array<int, kGreys> histogram{}, of_odd{};
  for (int y = 0; y < tile.rows; ++y) {
    const uint8_t* row = tile.ptr<uint8_t>(y);
    int x = 0;
    for (; x + 1 < tile.cols; x += 2) {
      ++histogram[row[x]];
      ++of_odd[row[x + 1]];
    }
    if (x < tile.cols) {
      ++histogram[row[x]];
    }
  }
  for (int grey = 0; grey < kGreys; ++grey) {
    histogram[grey] += of_odd[grey];
  }
  // Counts above the limit are spread over all grey values, the remainder at even steps.
  const int area = tile.rows * tile.cols;
  const int limit = std::max(1, static_cast<int>(clip_ * area / kGreys));
  int above = 0;
  for (int& count : histogram) {
    above += std::max(0, count - limit);
    count = std::min(count, limit);
  }
  const int remainder = above % kGreys;
  const int step = std::max(1, kGreys / std::max(1, remainder));
  for (int grey = 0; grey < kGreys; ++grey) {
    histogram[grey] += above / kGreys;
  }
  for (int grey = 0, left = remainder; grey < kGreys && left > 0; grey += step, --left) {
    ++histogram[grey];
  }
  Table table{};
  int sum = 0;
  for (int grey = 0; grey < kGreys; ++grey) {
    sum += histogram[grey];
    table[grey] =
        cv::saturate_cast<uint8_t>(static_cast<float>(sum) * 255.F / static_cast<float>(area));
  }
  return table;
}

PANGEA_VECTOR_CLONES
void Equaliser::Blend(const Table& first, const Table& second, int16_t weight,
                      std::array<int16_t, kGreys>* out) {
  for (int grey = 0; grey < kGreys; ++grey) {
    const auto difference = static_cast<int16_t>(second[grey] - first[grey]);
    (*out)[grey] = static_cast<int16_t>(kOne * first[grey] + weight * difference);
  }
}

cv::Mat Equaliser::Apply(const cv::Mat& image) {
  const int width = image.cols, height = image.rows;
  for (int row = 0; row < kTiles; ++row) {
    for (int column = 0; column < kTiles; ++column) {
      const int x = column * width / kTiles, y = row * height / kTiles;
      tables_[row][column] = TableOf(image(
          cv::Rect(x, y, (column + 1) * width / kTiles - x, (row + 1) * height / kTiles - y)));
    }
  }
  const std::vector<Strip> columns = StripsOf(width, kTiles);
  std::vector<int16_t> weights(2 * static_cast<size_t>(width));  // weights of a pixel's two tables
  for (int x = 0; x < width; ++x) {
    weights[2 * x + 1] = WeightAt(x, width, kTiles);
    weights[2 * x] = static_cast<int16_t>(kOne - weights[2 * x + 1]);
  }
  cv::Mat out(image.size(), CV_8U);
  // For each column of tiles: the table at a row's height. Then for each strip: the two tables that
  // its pixels blend, interleaved.
  std::array<std::array<int16_t, kGreys>, kTiles> of_row;
  std::array<int16_t, 2 * kGreys> pairs;
  std::vector<int16_t> of_pixels(2 * static_cast<size_t>(width));
  for (const Strip& rows : StripsOf(height, kTiles)) {
    for (int y = rows.begin; y < rows.end; ++y) {
      const int16_t weight = WeightAt(y, height, kTiles);
      for (int column = 0; column < kTiles; ++column) {
        Blend(tables_[rows.first][column], tables_[rows.second][column], weight, &of_row[column]);
      }
      for (const Strip& strip : columns) {
        Interleave(of_row[strip.first], of_row[strip.second], pairs);
        LookUp(pairs.data(), image.ptr<uint8_t>(y) + strip.begin, strip.end - strip.begin,
               &of_pixels[2 * static_cast<size_t>(strip.begin)]);
      }
      // Separate from the look-ups: only the blending can use vector instructions.
      BlendRow(of_pixels, weights, out.ptr<uint8_t>(y));
    }
  }
  return out;
}

}  // namespace pangea::vio
