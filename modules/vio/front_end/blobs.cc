#include "vio/front_end/blobs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <random>

namespace pangea::vio {
namespace {

constexpr size_t kBins = 128;  // 4 x 4 histograms of 8 directions
constexpr int kHalves = kDescriptorBits / static_cast<int>(kBins);
static_assert(kHalves * kBins == kDescriptorBits);
constexpr int kRounds = 2;
constexpr int kMaxOctave = 15;
// Blobs of this diameter are as well placed as corners on octave 0.
constexpr double kSureDiameter_px = 8;
// OpenCV doubles the image, and forgets half a pixel of that when it goes back (blobs_test.cc).
constexpr float kOffset_px = 0.25F;
// More are found than wanted, so that they can be spread.
constexpr int kMaxFound = 400;
constexpr double kLeastContrast = 0.02;
constexpr int kLayersOfAnOctave = 3;

using Bins = std::array<int, kBins>;

// The same on every machine: the standard says what this generator gives.
std::array<std::array<Bins, kRounds>, kHalves> RandomSigns() {
  std::mt19937 generator(1);
  std::array<std::array<Bins, kRounds>, kHalves> signs;
  for (auto& half : signs) {
    for (Bins& round : half) {
      for (int& sign : round) {
        sign = (generator() & 1) != 0 ? 1 : -1;
      }
    }
  }
  return signs;
}

// In place, not normalised.
void HadamardTransform(Bins* bins) {
  for (size_t step = 1; step < kBins; step *= 2) {
    for (size_t block = 0; block < kBins; block += 2 * step) {
      for (size_t i = block; i < block + step; ++i) {
        const int a = (*bins)[i];
        const int b = (*bins)[i + step];
        (*bins)[i] = a + b;
        (*bins)[i + step] = a - b;
      }
    }
  }
}

int OctaveOf(double diameter_px) {
  const double octave = std::log(diameter_px / kSureDiameter_px) / std::log(kOctaveScale);
  return std::clamp(static_cast<int>(std::lround(octave)), 0, kMaxOctave);
}

// Indices of the strongest of each cell first, then of the second of each, and so on: an even
// spread without losing the strong ones.
std::vector<int> SpreadOver(const std::vector<cv::KeyPoint>& blobs, int cell_px, int columns,
                            size_t wanted) {
  std::vector<int> order(blobs.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    return blobs[static_cast<size_t>(a)].response > blobs[static_cast<size_t>(b)].response;
  });
  std::map<int, int> count;
  std::vector<std::pair<int, int>> ranked;  // rank in its cell, blob
  for (const int i : order) {
    const cv::Point2f& at = blobs[static_cast<size_t>(i)].pt;
    const int cell = static_cast<int>(at.y) / cell_px * columns + static_cast<int>(at.x) / cell_px;
    ranked.emplace_back(count[cell]++, i);
  }
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<int> kept;
  for (size_t k = 0; k < std::min(wanted, ranked.size()); ++k) {
    kept.push_back(ranked[k].second);
  }
  return kept;
}

}  // namespace

Descriptor SignsOfProjections(std::span<const float> histogram) {
  static const auto kSigns = RandomSigns();
  // Whole numbers. Without their mean, which all histograms have in common.
  Bins centred;
  std::transform(histogram.begin(), histogram.end(), centred.begin(), [](float x) {
    return static_cast<int>(std::lround(static_cast<float>(kBins) * x));
  });
  const int mean = std::accumulate(centred.begin(), centred.end(), 0) / static_cast<int>(kBins);
  Descriptor descriptor{};
  size_t bit = 0;
  for (const auto& half : kSigns) {
    Bins bins = centred;
    std::for_each(bins.begin(), bins.end(), [mean](int& x) { x -= mean; });
    for (const Bins& signs : half) {
      std::transform(bins.begin(), bins.end(), signs.begin(), bins.begin(), std::multiplies<>());
      HadamardTransform(&bins);
      // The second transform would leave the range of int.
      std::for_each(bins.begin(), bins.end(), [](int& x) { x /= 16; });
    }
    for (const int x : bins) {
      descriptor[bit / 64] |= static_cast<uint64_t>(x > 0) << (bit % 64);
      ++bit;
    }
  }
  return descriptor;
}

BlobDescriber::BlobDescriber()
    : sift_(cv::SIFT::create(kMaxFound, kLayersOfAnOctave, kLeastContrast)) {}

std::vector<Corner> BlobDescriber::Describe(const cv::Mat& image, int wanted, int cell_px) const {
  if (wanted <= 0) {
    return {};
  }
  cv::Mat half;
  cv::resize(image, half, {image.cols / 2, image.rows / 2}, 0, 0, cv::INTER_AREA);
  std::vector<cv::KeyPoint> found;
  cv::Mat histograms;
  sift_->detectAndCompute(half, cv::noArray(), found, histograms);
  const Eigen::Vector2f to_image(static_cast<float>(image.cols) / static_cast<float>(half.cols),
                                 static_cast<float>(image.rows) / static_cast<float>(half.rows));
  std::vector<Corner> corners;
  for (const int i : SpreadOver(found, cell_px / 2, half.cols, static_cast<size_t>(wanted))) {
    const cv::KeyPoint& blob = found[static_cast<size_t>(i)];
    Corner corner;
    corner.pixel = {(blob.pt.x + 0.5F - kOffset_px) * to_image.x() - 0.5F,
                    (blob.pt.y + 0.5F - kOffset_px) * to_image.y() - 0.5F};
    corner.octave = static_cast<int8_t>(OctaveOf(blob.size * to_image.x()));
    corner.descriptor = SignsOfProjections({histograms.ptr<float>(i), kBins});
    corners.push_back(corner);
  }
  return corners;
}

}  // namespace pangea::vio
