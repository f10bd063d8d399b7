#include "vio/front_end/blobs/scale_space.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "vio/vector_clones.h"

namespace pangea::vio {
namespace {

constexpr int kLayers = 2;
// Lowe's values.
constexpr double kFirstSigma_px = 1.6;
constexpr double kSigmaOfAnImage_px = 0.5;
constexpr float kMaxRatioOfCurvatures = 10;
// Less than Lowe's 0.03, because white walls have little contrast.
constexpr float kMinBlobContrast = 0.01F;
constexpr int kRim_px = 5;
constexpr int kMinSide_px = 24;
constexpr float kMaxOffset = 0.75F;  // pixels, layers

cv::Mat Smooth(const cv::Mat& image, double sigma_px) {
  const int side = 2 * static_cast<int>(std::ceil(3 * sigma_px)) + 1;
  cv::Mat smoothed;
  cv::GaussianBlur(image, smoothed, {side, side}, sigma_px, sigma_px, cv::BORDER_REFLECT_101);
  return smoothed;
}

cv::Mat EverySecondPixel(const cv::Mat& image) {
  cv::Mat half((image.rows + 1) / 2, (image.cols + 1) / 2, CV_32F);
  for (int y = 0; y < half.rows; ++y) {
    const float* from = image.ptr<float>(2 * y);
    float* to = half.ptr<float>(y);
    for (int x = 0; x < half.cols; ++x) {
      to[x] = from[2 * x];
    }
  }
  return half;
}

double SigmaOfLayer(double layer) { return kFirstSigma_px * std::pow(2.0, layer / kLayers); }

using Layers = std::vector<cv::Mat>;

// Whether the pixel is a maximum (sign 1) or minimum (-1).
bool IsExtremum(const Layers& differences, int layer, int y, int x, float sign) {
  const float value = sign * differences[layer].at<float>(y, x);
  for (const int l : {layer, layer - 1, layer + 1}) {
    for (int v = y - 1; v <= y + 1; ++v) {
      const float* row = differences[l].ptr<float>(v);
      if (sign * row[x - 1] > value || sign * row[x] > value || sign * row[x + 1] > value) {
        return false;
      }
    }
  }
  return true;
}

struct Derivatives {
  Eigen::Vector3f gradient;  // with respect to x, y, layer
  Eigen::Matrix3f hessian;
};

Derivatives DerivativesAt(const Layers& differences, int layer, int y, int x) {
  const auto at = [&](int dl, int dy, int dx) {
    return differences[layer + dl].at<float>(y + dy, x + dx);
  };
  const float centre = at(0, 0, 0);
  const auto mixed = [&](auto value) {
    return (value(1, 1) - value(1, -1) - value(-1, 1) + value(-1, -1)) / 4;
  };
  Derivatives d;
  d.gradient << (at(0, 0, 1) - at(0, 0, -1)) / 2, (at(0, 1, 0) - at(0, -1, 0)) / 2,
      (at(1, 0, 0) - at(-1, 0, 0)) / 2;
  d.hessian(0, 0) = at(0, 0, 1) + at(0, 0, -1) - 2 * centre;
  d.hessian(1, 1) = at(0, 1, 0) + at(0, -1, 0) - 2 * centre;
  d.hessian(2, 2) = at(1, 0, 0) + at(-1, 0, 0) - 2 * centre;
  d.hessian(0, 1) = d.hessian(1, 0) = mixed([&](int a, int b) { return at(0, a, b); });
  d.hessian(0, 2) = d.hessian(2, 0) = mixed([&](int a, int b) { return at(a, 0, b); });
  d.hessian(1, 2) = d.hessian(2, 1) = mixed([&](int a, int b) { return at(a, b, 0); });
  return d;
}

// An edge is curved in one direction only (Lowe, section 4.1).
bool IsEdge(const Eigen::Matrix3f& hessian) {
  const float trace = hessian(0, 0) + hessian(1, 1);
  const float determinant = hessian.topLeftCorner<2, 2>().determinant();
  constexpr float r = kMaxRatioOfCurvatures;
  return determinant <= 0 || trace * trace * r >= (r + 1) * (r + 1) * determinant;
}

// Fits a parabola through the neighbours (Brown and Lowe, BMVC 2002); returns its extremum in
// pixels of the octave. Returns nothing if that is too far away, of low contrast or on an edge.
std::optional<Blob> Refine(const Layers& differences, int layer, int y, int x) {
  const Derivatives d = DerivativesAt(differences, layer, y, x);
  const Eigen::Vector3f offset = -d.hessian.fullPivLu().solve(d.gradient);
  if (!(offset.cwiseAbs().maxCoeff() < kMaxOffset)) {
    return std::nullopt;
  }
  const float value = differences[layer].at<float>(y, x) + 0.5F * d.gradient.dot(offset);
  if (std::abs(value) < kMinBlobContrast || IsEdge(d.hessian)) {
    return std::nullopt;
  }
  Blob blob;
  blob.pixel = {static_cast<float>(x) + offset.x(), static_cast<float>(y) + offset.y()};
  blob.sigma_px = static_cast<float>(SigmaOfLayer(layer + static_cast<double>(offset.z())));
  blob.response = std::abs(value);
  blob.level = layer - 1;
  return blob;
}

// Signs of a row's pixels: 1 if no neighbour of the four is above, -1 if none is below, else 0; 0
// also for a low contrast. Without branches, as it is done for every pixel.
PANGEA_VECTOR_CLONES
void ComparePixels(const float* above, const float* row, const float* below, int columns,
                   int8_t* sign) {
  constexpr float kLeast =
      0.5F * kMinBlobContrast;  // half, as the fit may increase a pixel's value
  for (int x = kRim_px; x < columns - kRim_px; ++x) {
    const float most = std::max(std::max(row[x - 1], row[x + 1]), std::max(above[x], below[x]));
    const float least = std::min(std::min(row[x - 1], row[x + 1]), std::min(above[x], below[x]));
    const int maximum = static_cast<int>(row[x] >= std::max(most, kLeast));
    const int minimum = static_cast<int>(row[x] <= std::min(least, -kLeast));
    sign[x] = static_cast<int8_t>(maximum - minimum);
  }
}

// The first index from `x` on with a sign that is not 0, or `end`. Skips eight zeros at a time.
int NextOf(const std::vector<int8_t>& signs, int x, int end) {
  for (uint64_t eight = 0; x + 8 <= end; x += 8) {
    std::memcpy(&eight, &signs[static_cast<size_t>(x)], sizeof(eight));
    if (eight != 0) {
      break;
    }
  }
  while (x < end && signs[static_cast<size_t>(x)] == 0) {
    ++x;
  }
  return x;
}

void FindInLayer(const Layers& differences, int layer, std::vector<Blob>* blobs) {
  const cv::Mat& level = differences[layer];
  std::vector<int8_t> signs(static_cast<size_t>(level.cols));
  const int end = level.cols - kRim_px;
  for (int y = kRim_px; y < level.rows - kRim_px; ++y) {
    ComparePixels(level.ptr<float>(y - 1), level.ptr<float>(y), level.ptr<float>(y + 1), level.cols,
                  signs.data());
    for (int x = NextOf(signs, kRim_px, end); x < end; x = NextOf(signs, x + 1, end)) {
      if (!IsExtremum(differences, layer, y, x, signs[static_cast<size_t>(x)])) {
        continue;
      }
      if (const auto blob = Refine(differences, layer, y, x)) {
        blobs->push_back(*blob);
      }
    }
  }
}

// The image, then images that are each smoother by the same ratio; the last but two has twice the
// sigma of the first.
Layers SmoothedLayers(const cv::Mat& first) {
  Layers smoothed{first};
  for (int layer = 1; layer < kLayers + 3; ++layer) {
    const double before = SigmaOfLayer(layer - 1), now = SigmaOfLayer(layer);
    smoothed.push_back(Smooth(smoothed.back(), std::sqrt(now * now - before * before)));
  }
  return smoothed;
}

std::vector<Blob> FindBlobs(const Layers& smoothed) {
  Layers differences(smoothed.size() - 1);
  for (size_t i = 0; i < differences.size(); ++i) {
    cv::subtract(smoothed[i + 1], smoothed[i], differences[i]);
  }
  std::vector<Blob> blobs;
  for (int layer = 1; layer <= kLayers; ++layer) {
    FindInLayer(differences, layer, &blobs);
  }
  return blobs;
}

}  // namespace

ScaleSpace::ScaleSpace(const cv::Mat& image) {
  cv::Mat first;
  image.convertTo(first, CV_32F, 1.0 / 255);
  first = Smooth(
      first, std::sqrt(kFirstSigma_px * kFirstSigma_px - kSigmaOfAnImage_px * kSigmaOfAnImage_px));
  for (; std::min(first.cols, first.rows) >= kMinSide_px; first = EverySecondPixel(first)) {
    const Layers smoothed = SmoothedLayers(first);
    for (Blob& blob : FindBlobs(smoothed)) {
      blob.level += static_cast<int>(levels_.size());
      blob.pixel *= PixelWidth(blob);
      blob.sigma_px *= PixelWidth(blob);
      blobs_.push_back(blob);
    }
    levels_.insert(levels_.end(), smoothed.begin() + 1, smoothed.begin() + 1 + kLayers);
    first = smoothed[kLayers];
  }
}

float ScaleSpace::PixelWidth(const Blob& blob) const {
  return static_cast<float>(1 << (blob.level / kLayers));
}

}  // namespace pangea::vio
