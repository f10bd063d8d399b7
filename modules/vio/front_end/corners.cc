#include "vio/front_end/corners.h"

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>

#include "vio/vector_clones.h"

namespace pangea::vio {
namespace {

constexpr int kCornerBlock_px = 5;
// Converts products of the pyramid's derivatives (Scharr's filter) to the units of
// cv::cornerMinEigenVal.
constexpr float kGradientScale = 1.F / (4 * 4 * 5 * 255.F) / (4 * 4 * 5 * 255.F);

// Shi and Tomasi's response: the smaller eigenvalue of the gradients' second moments, summed over a
// block around each pixel.
PANGEA_VECTOR_CLONES
cv::Mat1f CornerResponse(const cv::Mat& derivatives, const cv::Rect& cell) {
  constexpr int kReach = kCornerBlock_px / 2;
  cv::Mat gradients = derivatives(cell);
  gradients.adjustROI(kReach, kReach, kReach, kReach);
  // Sums over the last kCornerBlock_px rows, for each column.
  std::vector<int> xx(gradients.cols, 0), xy(gradients.cols, 0), yy(gradients.cols, 0);
  const auto add_row = [&](int y, int sign) __attribute__((always_inline)) {
    const auto* gradient = gradients.ptr<int16_t>(y);
    for (int x = 0; x < gradients.cols; ++x) {
      const int dx = gradient[2 * x], dy = gradient[2 * x + 1];
      xx[x] += sign * dx * dx;
      xy[x] += sign * dx * dy;
      yy[x] += sign * dy * dy;
    }
  };
  const auto block = [](const std::vector<int>& sums, int x) {
    static_assert(kCornerBlock_px == 5);
    const int sum = sums[x] + sums[x + 1] + sums[x + 2] + sums[x + 3] + sums[x + 4];
    return kGradientScale * static_cast<float>(sum);
  };
  cv::Mat1f response(cell.size());
  Eigen::ArrayXf discriminant(cell.width);
  for (int y = 0; y < gradients.rows; ++y) {
    add_row(y, 1);
    if (y < 2 * kReach) {
      continue;
    }
    Eigen::Map<Eigen::ArrayXf> row(response[y - 2 * kReach], cell.width);
    for (int x = 0; x < cell.width; ++x) {
      const float a = 0.5F * block(xx, x), b = block(xy, x), c = 0.5F * block(yy, x);
      row[x] = a + c;
      discriminant[x] = (a - c) * (a - c) + b * b;
    }
    row -= discriminant.sqrt();
    add_row(y - 2 * kReach, -1);
  }
  return response;
}

}  // namespace

std::vector<RatedCorner> FindCorners(const cv::Mat& derivatives, const cv::Rect& cell,
                                     float least) {
  const cv::Mat1f response = CornerResponse(derivatives, cell);
  const int inner = response.cols - 2;
  Eigen::ArrayXf column_max(response.cols), block_max(inner);
  std::vector<RatedCorner> corners;
  for (int y = 1; y + 1 < response.rows; ++y) {
    using Row = Eigen::Map<const Eigen::ArrayXf>;
    const Row above(response[y - 1], response.cols), row(response[y], response.cols),
        below(response[y + 1], response.cols);
    column_max = above.max(row).max(below);
    block_max =
        column_max.head(inner).max(column_max.segment(1, inner)).max(column_max.tail(inner));
    for (int x = 1; x <= inner; ++x) {
      const float r = row[x];
      if (r < block_max[x - 1] || r < least) {
        continue;
      }
      // Of neighbours with equal responses, the first of the first row is taken.
      if (r > row[x - 1] && r > std::max({above[x - 1], above[x], above[x + 1]})) {
        corners.emplace_back(r, cv::Point(cell.x + x, cell.y + y));
      }
    }
  }
  return corners;
}

}  // namespace pangea::vio
