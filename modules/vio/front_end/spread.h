#pragma once

#include <algorithm>
#include <cstddef>
#include <opencv2/core.hpp>
#include <utility>
#include <vector>

namespace pangea::vio {

// Selects at most `wanted` items, by their member `response`: first the strongest of each image
// cell, then the second of each, and so on, so that they are spread evenly and strong ones are
// kept. Items with equal response keep their order.
template <typename T>
std::vector<T> SpreadOver(std::vector<T> items, cv::Point2f T::*place, int cell_px,
                          int image_columns, size_t wanted) {
  std::stable_sort(items.begin(), items.end(),
                   [](const T& a, const T& b) { return a.response > b.response; });
  const int columns = (image_columns + cell_px - 1) / cell_px;
  std::vector<std::pair<int, size_t>> ranked;  // (rank in its cell, index)
  std::vector<int> count;                      // items per cell
  for (size_t i = 0; i < items.size(); ++i) {
    const cv::Point2f& at = items[i].*place;
    const size_t cell =
        static_cast<size_t>(at.y) / cell_px * columns + static_cast<size_t>(at.x) / cell_px;
    count.resize(std::max(count.size(), cell + 1), 0);
    ranked.emplace_back(count[cell]++, i);
  }
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<T> kept;
  for (size_t i = 0; i < std::min(wanted, ranked.size()); ++i) {
    kept.push_back(items[ranked[i].second]);
  }
  return kept;
}

}  // namespace pangea::vio
