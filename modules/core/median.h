#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace pangea {

// The middle value; of an even number of values the upper one of the two. `values` is not empty.
template <typename T>
T Median(std::vector<T> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace pangea
