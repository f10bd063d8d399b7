#include "vio/front_end/equalizer.h"

#include <algorithm>
#include <cmath>

namespace pangea::vio {
namespace {

constexpr int kOne = 128;  // a weight of 1: a grey value times it fits 16 bits

// The rows (or columns) between the centres of two neighbouring tiles; beyond the outermost centre
// there is one tile only.
struct Strip {
  int begin = 0, end = 0;
  int first = 0, second = 0;  // tile
};

std::vector<Strip> StripsOf(int size, int tiles) {
  std::vector<Strip> strips;
  for (int k = 0; k <= tiles; ++k) {
    const auto centre = [&](int tile) {  // the first pixel that is not before it
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

}  // namespace

Equalizer::Table Equalizer::TableOf(const cv::Mat& tile) const {
  // Two, for neighbours are often alike, and a count must be written before it is read again.
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
  // What is above the limit is spread over all grey values, the remainder at even steps.
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

void Equalizer::Blend(const Table& first, const Table& second, int16_t weight,
                      std::array<int16_t, kGreys>* out) {
  for (int grey = 0; grey < kGreys; ++grey) {
    const auto difference = static_cast<int16_t>(second[grey] - first[grey]);
    (*out)[grey] = static_cast<int16_t>(kOne * first[grey] + weight * difference);
  }
}

cv::Mat Equalizer::Apply(const cv::Mat& image) {
  const int width = image.cols, height = image.rows;
  for (int row = 0; row < kTiles; ++row) {
    for (int column = 0; column < kTiles; ++column) {
      const int x = column * width / kTiles, y = row * height / kTiles;
      tables_[row][column] = TableOf(image(
          cv::Rect(x, y, (column + 1) * width / kTiles - x, (row + 1) * height / kTiles - y)));
    }
  }
  const std::vector<Strip> columns = StripsOf(width, kTiles);
  std::vector<int16_t> weights(width);
  for (int x = 0; x < width; ++x) {
    weights[x] = WeightAt(x, width, kTiles);
  }
  cv::Mat out(image.size(), CV_8U);
  // The tables at a row's height, of all columns of tiles: a pixel then blends two values.
  std::array<std::array<int16_t, kGreys>, kTiles> of_row;
  std::vector<int16_t> of_left(width), of_right(width);
  for (const Strip& rows : StripsOf(height, kTiles)) {
    for (int y = rows.begin; y < rows.end; ++y) {
      const int16_t weight = WeightAt(y, height, kTiles);
      for (int column = 0; column < kTiles; ++column) {
        Blend(tables_[rows.first][column], tables_[rows.second][column], weight, &of_row[column]);
      }
      const uint8_t* from = image.ptr<uint8_t>(y);
      uint8_t* to = out.ptr<uint8_t>(y);
      for (const Strip& strip : columns) {
        const int16_t* left = of_row[strip.first].data();
        const int16_t* right = of_row[strip.second].data();
        for (int x = strip.begin; x < strip.end; ++x) {
          of_left[x] = left[from[x]];
          of_right[x] = right[from[x]];
        }
      }
      // Apart from the look-ups, which are no vector instructions, as this is.
      for (int x = 0; x < width; ++x) {
        const int sum = (kOne - weights[x]) * of_left[x] + weights[x] * of_right[x];
        to[x] = static_cast<uint8_t>((sum + kOne * kOne / 2) / (kOne * kOne));
      }
    }
  }
  return out;
}

}  // namespace pangea::vio
