#include "vio/front_end/blobs/blob_descriptor.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <numbers>
#include <numeric>
#include <random>

#include "vio/vector_clones.h"

namespace pangea::vio {
namespace {

constexpr size_t kBins = 128;  // 4 x 4 histograms of 8 directions
constexpr int kHalves = kDescriptorBits / static_cast<int>(kBins);
static_assert(kHalves * kBins == kDescriptorBits);
constexpr int kRounds = 2;
// Lowe, section 5: gradients in a Gaussian window of 1.5 times the blob's sigma, cut off at three
// sigmas of the window; 36 directions, and each with at least 0.8 of the strongest is used.
constexpr int kDirections = 36;
constexpr float kWindowOfDirection = 1.5F;  // sigma of the window, in the blob's sigmas
constexpr float kOtherDirection = 0.8F;
// Section 6: 4 x 4 histograms of 8 directions, each three sigmas wide.
constexpr int kCells = 4;
constexpr int kCellDirections = 8;
static_assert(kCells * kCells * kCellDirections == kBins);
constexpr float kCellWidth = 3;  // in the blob's sigmas
constexpr float kMaxBin = 0.2F;
constexpr float kLength = 512;
// Distance between gradient samples, in the blob's sigmas: finer than the image is smooth.
constexpr float kStep = 0.75F;

using Bins = std::array<int, kBins>;
using Histogram = std::array<float, kBins>;

// The same on every machine: the C++ standard defines the output of this generator.
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

// Transforms in place, without normalisation.
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

struct WindowSample {
  float x = 0, y = 0;  // offset from the blob's centre, in steps
  float weight = 0;
};

// The inner samples of a GradientPatch, row by row, with Gaussian weights.
std::vector<WindowSample> GaussianWindow(int half_side, float sigma) {
  std::vector<WindowSample> window;
  for (int row = 0; row < 2 * half_side; ++row) {
    for (int column = 0; column < 2 * half_side; ++column) {
      const float x = static_cast<float>(column - half_side) + 0.5F;
      const float y = static_cast<float>(row - half_side) + 0.5F;
      window.push_back({x, y, std::exp(-(x * x + y * y) / (2 * sigma * sigma))});
    }
  }
  return window;
}

constexpr int kMaxSide = 32;  // samples in a row of a patch
constexpr int SideOf(int half_side) { return 2 * half_side + 2; }

// Samples the image at equal steps along a row, whose middle is `across` from the centre. Outside
// the image the rim's pixels are repeated.
PANGEA_VECTOR_CLONES
void InterpolateRow(const cv::Mat& level, const Eigen::Vector2f& centre,
                    const Eigen::Vector2f& along, const Eigen::Vector2f& across,
                    std::span<float> out) {
  std::array<float, kMaxSide> a, b;
  std::array<int, kMaxSide> offset;
  std::array<float, 2 * kMaxSide> upper, lower;  // each pixel and its right neighbour
  const size_t count = out.size();
  const float first = -0.5F * static_cast<float>(count - 1);
  const float right = static_cast<float>(level.cols) - 1.001F,
              bottom = static_cast<float>(level.rows) - 1.001F;
  const auto step = static_cast<int>(level.step1());
  for (size_t i = 0; i < count; ++i) {
    const float from_centre = first + static_cast<float>(static_cast<int>(i));
    const float x =
        std::min(std::max(centre.x() + from_centre * along.x() + across.x(), 0.F), right);
    const float y =
        std::min(std::max(centre.y() + from_centre * along.y() + across.y(), 0.F), bottom);
    const int column = static_cast<int>(x), row = static_cast<int>(y);
    a[i] = x - static_cast<float>(column);
    b[i] = y - static_cast<float>(row);
    offset[i] = row * step + column;
  }
  const auto* pixels = level.ptr<float>();
  for (size_t i = 0; i < count; ++i) {
    std::memcpy(&upper[2 * i], pixels + offset[i], 2 * sizeof(float));
    std::memcpy(&lower[2 * i], pixels + offset[i] + step, 2 * sizeof(float));
  }
  for (size_t i = 0; i < count; ++i) {
    out[i] = (1 - b[i]) * ((1 - a[i]) * upper[2 * i] + a[i] * upper[2 * i + 1]) +
             b[i] * ((1 - a[i]) * lower[2 * i] + a[i] * lower[2 * i + 1]);
  }
}

// Gradients around a blob on a square grid that is rotated by `direction`, in the grid's axes.
class GradientPatch {
 public:
  GradientPatch(const ScaleSpace& space, const Blob& blob, float direction, int half_side)
      : side_(SideOf(half_side)) {
    const float width = space.PixelWidth(blob);
    const float step_px = kStep * blob.sigma_px / width;
    const Eigen::Vector2f along =
        step_px * Eigen::Vector2f(std::cos(direction), std::sin(direction));
    const Eigen::Vector2f across(-along.y(), along.x());
    const Eigen::Vector2f centre = Eigen::Vector2f(blob.pixel.x, blob.pixel.y) / width;
    const cv::Mat& level = space.Level(blob);
    values_.resize(static_cast<size_t>(side_) * side_);
    const float first = -0.5F * static_cast<float>(side_ - 1);
    for (int row = 0; row < side_; ++row) {
      InterpolateRow(level, centre, along, (first + static_cast<float>(row)) * across,
                     {&values_[static_cast<size_t>(row) * side_], static_cast<size_t>(side_)});
    }
  }

  // Calls function(sample of the window, gradient x, gradient y) for each inner sample.
  template <typename Function>
  void ForEach(const std::vector<WindowSample>& window, Function function) const {
    auto sample = window.begin();
    for (int row = 1; row + 1 < side_; ++row) {
      for (int column = 1; column + 1 < side_; ++column, ++sample) {
        const float* at = &values_[static_cast<size_t>(row) * side_ + column];
        function(*sample, at[1] - at[-1], at[side_] - at[-side_]);
      }
    }
  }

 private:
  int side_ = 0;
  std::vector<float> values_;
};

// Returns a value from 0 to below `directions`.
float DirectionBin(float gradient_x, float gradient_y, int directions) {
  const float bin = cv::fastAtan2(gradient_y, gradient_x) * static_cast<float>(directions) / 360.F;
  return bin < static_cast<float>(directions) ? bin : 0.F;
}

// Returns the strongest direction and others about as strong; radians.
std::vector<float> DirectionsOf(const ScaleSpace& space, const Blob& blob) {
  constexpr float kSigma = kWindowOfDirection / kStep;  // steps
  constexpr int kHalfSide = static_cast<int>(3 * kSigma);
  static_assert(SideOf(kHalfSide) <= kMaxSide);
  static const std::vector<WindowSample> kWindow = GaussianWindow(kHalfSide, kSigma);
  std::array<float, kDirections> raw{}, smooth{};
  GradientPatch(space, blob, 0, kHalfSide)
      .ForEach(kWindow, [&](const WindowSample& sample, float gx, float gy) {
        const int bin =
            static_cast<int>(std::lround(DirectionBin(gx, gy, kDirections))) % kDirections;
        raw[static_cast<size_t>(bin)] += sample.weight * std::sqrt(gx * gx + gy * gy);
      });
  const auto around = [](const auto& bins, int i) {
    return bins[static_cast<size_t>((i + kDirections) % kDirections)];
  };
  for (int i = 0; i < kDirections; ++i) {
    smooth[static_cast<size_t>(i)] = (around(raw, i - 2) + around(raw, i + 2)) / 16 +
                                     (around(raw, i - 1) + around(raw, i + 1)) / 4 +
                                     around(raw, i) * 3 / 8;
  }
  const float strongest = *std::max_element(smooth.begin(), smooth.end());
  std::vector<float> directions;
  for (int i = 0; i < kDirections; ++i) {
    const float left = around(smooth, i - 1), here = around(smooth, i),
                right = around(smooth, i + 1);
    if (here > left && here > right && here >= kOtherDirection * strongest) {
      const float bin = static_cast<float>(i) + 0.5F * (left - right) / (left - 2 * here + right);
      directions.push_back(bin * 2 * std::numbers::pi_v<float> / kDirections);
    }
  }
  return directions;
}

// A gradient shares its weight among the nearest cells and directions.
void AddGradient(float x, float y, float direction, float weight, Histogram* histogram) {
  const int column = static_cast<int>(std::floor(x)), row = static_cast<int>(std::floor(y)),
            bin = static_cast<int>(direction);
  for (const int dy : {0, 1}) {
    for (const int dx : {0, 1}) {
      if (column + dx < 0 || column + dx >= kCells || row + dy < 0 || row + dy >= kCells) {
        continue;
      }
      const float share = weight * (1 - std::abs(x - static_cast<float>(column + dx))) *
                          (1 - std::abs(y - static_cast<float>(row + dy)));
      const float later = direction - static_cast<float>(bin);
      float* cell =
          &(*histogram)[static_cast<size_t>((row + dy) * kCells + column + dx) * kCellDirections];
      cell[bin] += share * (1 - later);
      cell[(bin + 1) % kCellDirections] += share * later;
    }
  }
}

// Limits each bin to 0.2 of the length (Lowe, section 6.1), then scales the length to 512.
void Normalise(Histogram* histogram) {
  Eigen::Map<Eigen::Matrix<float, kBins, 1>> bins(histogram->data());
  bins.normalize();
  bins = bins.cwiseMin(kMaxBin).eval();
  bins *= kLength / bins.norm();
}

Histogram HistogramOf(const ScaleSpace& space, const Blob& blob, float direction) {
  constexpr float kStepsOfACell = kCellWidth / kStep;
  constexpr int kHalfSide = static_cast<int>((kCells + 1) * kStepsOfACell / 2);
  static_assert(SideOf(kHalfSide) <= kMaxSide);
  constexpr float kSigma = kCells * kStepsOfACell / 2;  // of the window
  constexpr float kMiddle = 0.5F * (kCells - 1);
  static const std::vector<WindowSample> kWindow = GaussianWindow(kHalfSide, kSigma);
  Histogram histogram{};
  GradientPatch(space, blob, direction, kHalfSide)
      .ForEach(kWindow, [&](const WindowSample& sample, float gx, float gy) {
        AddGradient(sample.x / kStepsOfACell + kMiddle, sample.y / kStepsOfACell + kMiddle,
                    DirectionBin(gx, gy, kCellDirections),
                    sample.weight * std::sqrt(gx * gx + gy * gy), &histogram);
      });
  Normalise(&histogram);
  return histogram;
}

}  // namespace

Descriptor SignsOfProjections(std::span<const float> histogram) {
  static const auto kSigns = RandomSigns();
  // Integers, without the histogram's mean, which is the same for all histograms.
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
      // Without this division the second transform would overflow int.
      std::for_each(bins.begin(), bins.end(), [](int& x) { x /= 16; });
    }
    for (const int x : bins) {
      descriptor[bit / 64] |= static_cast<uint64_t>(x > 0) << (bit % 64);
      ++bit;
    }
  }
  return descriptor;
}

std::vector<Descriptor> DescribeBlob(const ScaleSpace& space, const Blob& blob) {
  std::vector<Descriptor> descriptors;
  for (const float direction : DirectionsOf(space, blob)) {
    descriptors.push_back(SignsOfProjections(HistogramOf(space, blob, direction)));
  }
  return descriptors;
}

}  // namespace pangea::vio
