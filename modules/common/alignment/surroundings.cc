#include "common/alignment/surroundings.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace pangea {

int ImageCell(const CameraModel& camera, const Eigen::Vector2d& pixel) {
  constexpr int kCols = 6, kRows = 4;
  const int col = std::clamp(static_cast<int>(pixel.x() * kCols / camera.width), 0, kCols - 1);
  const int row = std::clamp(static_cast<int>(pixel.y() * kRows / camera.height), 0, kRows - 1);
  return row * kCols + col;
}

void Surroundings::Add(const CameraModel& camera, const SearchResult& result) {
  std::map<int, Cell> cells;
  for (const Projection& projection : result.projections) {
    if (projection.comparable) {
      Cell& cell = cells[ImageCell(camera, projection.pixel)];
      ++cell.comparable;
      cell.found += projection.found ? 1 : 0;
    }
  }
  for (const auto& [index, cell] : cells) {
    comparable_ += cell.comparable;
    found_ += cell.found;
    cells_.push_back(cell);
  }
}

double Surroundings::supported_share() const {
  // Supported: a quarter of its points found, and not one alone.
  constexpr double kShare = 0.25;
  constexpr int kMinFound = 2;
  // Contradicted: what is found, or less, would be a chance of one in five or rarer.
  constexpr double kChance = 0.2;
  const auto supports = [](const Cell& cell) {
    return cell.found >= kMinFound && cell.found >= kShare * cell.comparable;
  };
  int supported = 0, comparable = 0, found = 0;
  for (const Cell& cell : cells_) {
    if (supports(cell)) {
      ++supported;
      comparable += cell.comparable;
      found += cell.found;
    }
  }
  if (supported == 0) {
    return 0;
  }
  const double rate = std::min(0.95, static_cast<double>(found) / comparable);
  int contradicted = 0;
  for (const Cell& cell : cells_) {
    if (supports(cell)) {
      continue;
    }
    // P(at most `found` of `comparable`) at that rate.
    double probability = 0, term = std::pow(1 - rate, cell.comparable);
    for (int k = 0; k <= cell.found; ++k) {
      probability += term;
      term *= rate / (1 - rate) * (cell.comparable - k) / (k + 1);
    }
    contradicted += probability < kChance ? 1 : 0;
  }
  return static_cast<double>(supported) / (supported + contradicted);
}

}  // namespace pangea
