#include "vio/front_end/equalizer.h"

#include <algorithm>
#include <cmath>

namespace pangea::vio {
namespace {

constexpr int kOne = 256;  // a weight of 1

// The tiles whose centres are beside a row or column, and the weight of the second of them.
struct Between {
  int first = 0, second = 0;
  int weight = 0;
};

std::vector<Between> BetweenCentres(int size, int tiles) {
  std::vector<Between> between;
  between.reserve(size);
  for (int i = 0; i < size; ++i) {
    const float at = static_cast<float>(i * tiles) / static_cast<float>(size) - 0.5F;
    const int first = static_cast<int>(std::floor(at));
    const int weight = cvRound(kOne * (at - static_cast<float>(first)));
    between.push_back({std::max(first, 0), std::min(first + 1, tiles - 1), weight});
  }
  return between;
}

}  // namespace

Equalizer::Table Equalizer::TableOf(const cv::Mat& tile) const {
  std::array<int, kGreys> histogram{};
  for (int y = 0; y < tile.rows; ++y) {
    const uint8_t* row = tile.ptr<uint8_t>(y);
    for (int x = 0; x < tile.cols; ++x) {
      ++histogram[row[x]];
    }
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

cv::Mat Equalizer::Apply(const cv::Mat& image) {
  const int width = image.cols, height = image.rows;
  for (int row = 0; row < kTiles; ++row) {
    for (int column = 0; column < kTiles; ++column) {
      const int x = column * width / kTiles, y = row * height / kTiles;
      tables_[row][column] = TableOf(image(
          cv::Rect(x, y, (column + 1) * width / kTiles - x, (row + 1) * height / kTiles - y)));
    }
  }
  const std::vector<Between> rows = BetweenCentres(height, kTiles);
  const std::vector<Between> columns = BetweenCentres(width, kTiles);
  cv::Mat out(image.size(), CV_8U);
  // The tables of a row's height, of all columns of tiles: a pixel then blends two values.
  std::array<std::array<uint16_t, kGreys>, kTiles> of_row;
  for (int y = 0; y < height; ++y) {
    const int weight = rows[y].weight;
    for (int column = 0; column < kTiles; ++column) {
      const Table& above = tables_[rows[y].first][column];
      const Table& below = tables_[rows[y].second][column];
      for (int grey = 0; grey < kGreys; ++grey) {
        of_row[column][grey] =
            static_cast<uint16_t>(above[grey] * (kOne - weight) + below[grey] * weight);
      }
    }
    const uint8_t* from = image.ptr<uint8_t>(y);
    uint8_t* to = out.ptr<uint8_t>(y);
    for (int x = 0; x < width; ++x) {
      const Between& column = columns[x];
      const int left = of_row[column.first][from[x]];
      const int right = of_row[column.second][from[x]];
      const int sum = left * (kOne - column.weight) + right * column.weight;
      to[x] = static_cast<uint8_t>((sum + kOne * kOne / 2) / (kOne * kOne));
    }
  }
  return out;
}

}  // namespace pangea::vio
