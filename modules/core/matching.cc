#include "core/matching.h"

#include <algorithm>

#include "core/nearest_corner.h"

namespace pangea {
namespace {

constexpr double kCellPx = 32.0;

}  // namespace

std::vector<CornerMatch> MatchCorners(const std::vector<Corner>& a, const std::vector<Corner>& b,
                                      const MatchingOptions& options) {
  const auto distance_of = [&](int i, int j) {
    return HammingDistance(a[i].descriptor, b[j].descriptor);
  };
  return MutualNearest(a.size(), b, distance_of, options);
}

CornerGrid::CornerGrid(const std::vector<Corner>& corners) : corners_(&corners) {
  if (corners.empty()) {
    cells_.resize(1);
    return;
  }
  Eigen::Vector2f low = corners.front().pixel;
  Eigen::Vector2f high = low;
  for (const Corner& corner : corners) {
    low = low.cwiseMin(corner.pixel);
    high = high.cwiseMax(corner.pixel);
  }
  origin_ = low.cast<double>();
  columns_ = static_cast<int>((high.x() - low.x()) / kCellPx) + 1;
  rows_ = static_cast<int>((high.y() - low.y()) / kCellPx) + 1;
  cells_.resize(static_cast<size_t>(columns_) * rows_);
  for (int i = 0; i < static_cast<int>(corners.size()); ++i) {
    const Eigen::Vector2f& pixel = corners[i].pixel;
    cells_[Row(pixel.y()) * columns_ + Column(pixel.x())].push_back(i);
  }
}

int CornerGrid::Column(double u) const {
  return static_cast<int>(std::clamp((u - origin_.x()) / kCellPx, 0.0, columns_ - 1.0));
}

int CornerGrid::Row(double v) const {
  return static_cast<int>(std::clamp((v - origin_.y()) / kCellPx, 0.0, rows_ - 1.0));
}

std::vector<int> CornerGrid::Within(const Eigen::Vector2d& pixel, double radius_px) const {
  std::vector<int> found;
  for (int row = Row(pixel.y() - radius_px); row <= Row(pixel.y() + radius_px); ++row) {
    for (int column = Column(pixel.x() - radius_px); column <= Column(pixel.x() + radius_px);
         ++column) {
      for (const int i : cells_[row * columns_ + column]) {
        if (((*corners_)[i].pixel.cast<double>() - pixel).squaredNorm() <= radius_px * radius_px) {
          found.push_back(i);
        }
      }
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

std::optional<CornerMatch> CornerGrid::Nearest(const Eigen::Vector2d& pixel, double radius_px,
                                               const Descriptor& descriptor,
                                               const MatchingOptions& options) const {
  const auto distance_of = [&](int i) {
    return HammingDistance(descriptor, (*corners_)[i].descriptor);
  };
  const NearestCorner nearest = FindNearest(*corners_, Within(pixel, radius_px), distance_of,
                                            options.max_distance, options.other_corner_px);
  if (nearest.index < 0 || !nearest.PassesRatio(options.max_ratio)) {
    return std::nullopt;
  }
  return CornerMatch{0, nearest.index, nearest.distance};
}

}  // namespace pangea
