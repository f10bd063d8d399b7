#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace pangea {

// The middle value; of an even number of them the upper of the two. There must be one.
template <typename T>
T Median(std::vector<T> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace pangea
