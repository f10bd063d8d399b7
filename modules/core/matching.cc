#include "core/matching.h"

#include <algorithm>
#include <cmath>

namespace pangea {
namespace {

constexpr int kFar = 257;  // more than any distance
constexpr double kCellPx = 32.0;

bool PassesRatio(int best, int second, double max_ratio) {
  return best <= max_ratio * static_cast<double>(second);
}

}  // namespace

std::vector<CornerMatch> MatchCorners(const std::vector<Corner>& a, const std::vector<Corner>& b,
                                      const MatchingOptions& options) {
  std::vector<int> row(b.size());
  std::vector<int> column_best(b.size(), kFar);  // of each b: its nearest a and the distance
  std::vector<int> column_index(b.size(), -1);
  std::vector<CornerMatch> rows;
  const auto other_corner_px = static_cast<float>(options.other_corner_px);
  for (int i = 0; i < static_cast<int>(a.size()); ++i) {
    const Descriptor& descriptor = a[i].descriptor;
    int best = kFar;
    int best_j = -1;
    for (int j = 0; j < static_cast<int>(b.size()); ++j) {
      const int distance = HammingDistance(descriptor, b[j].descriptor);
      row[j] = distance;
      if (distance < best) {
        best = distance;
        best_j = j;
      }
      if (distance < column_best[j]) {
        column_best[j] = distance;
        column_index[j] = i;
      }
    }
    if (best > options.max_distance) {
      continue;
    }
    int second = kFar;
    for (int j = 0; j < static_cast<int>(b.size()); ++j) {
      if (row[j] < second && (b[j].pixel - b[best_j].pixel).norm() > other_corner_px) {
        second = row[j];
      }
    }
    if (PassesRatio(best, second, options.max_ratio)) {
      rows.push_back({i, best_j, best});
    }
  }
  std::erase_if(rows, [&](const CornerMatch& match) { return column_index[match.b] != match.a; });
  return rows;
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
  const std::vector<int> near = Within(pixel, radius_px);
  CornerMatch best{0, -1, kFar};
  for (const int i : near) {
    const int distance = HammingDistance(descriptor, (*corners_)[i].descriptor);
    if (distance < best.distance) {
      best = {0, i, distance};
    }
  }
  if (best.b < 0 || best.distance > options.max_distance) {
    return std::nullopt;
  }
  int second = kFar;
  for (const int i : near) {
    const Eigen::Vector2f apart = (*corners_)[i].pixel - (*corners_)[best.b].pixel;
    if (apart.norm() > static_cast<float>(options.other_corner_px)) {
      second = std::min(second, HammingDistance(descriptor, (*corners_)[i].descriptor));
    }
  }
  if (!PassesRatio(best.distance, second, options.max_ratio)) {
    return std::nullopt;
  }
  return best;
}

}  // namespace pangea
