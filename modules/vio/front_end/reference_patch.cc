#include "vio/front_end/reference_patch.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <opencv2/core/hal/intrin.hpp>

#include "vio/vector_clones.h"

namespace pangea::vio {
namespace {

constexpr int kIterations = 10;
constexpr float kConverged_px = 0.02F;
// Largest correction of the result of image-to-image tracking; beyond it lies another place.
constexpr float kMaxCorrection_px = 2.0F;
// Smallest accepted correlation of the patch with the image.
constexpr float kMinCorrelation = 0.85F;
// Limits of the singular values of a deformation; beyond them it is not the same patch.
constexpr float kMinStretch = 0.6F;
constexpr float kMaxStretch = 1.7F;
// Smallest standard deviation of grey values that counts as texture, not noise.
constexpr float kMinContrast = 2.0F;
// Weight of the prior that the deformation changes little from image to image. It is relative to
// the position columns of the patch's own gradients.
constexpr float kStiffness = 0.02F;
constexpr int kPadded = 24;     // row of the largest patch, rounded up to eights
constexpr float kTiny = 1e-9F;  // keeps the normal matrix of striped patches invertible

// Works at any address: OpenCV's v_lut_pairs reads a short, which is undefined at odd addresses.
uint16_t PairAt(const uchar* grey) {
  uint16_t pair = 0;
  std::memcpy(&pair, grey, sizeof(pair));
  return pair;
}

// Eight pixels, each blended with its right neighbour, which has the weight `share`.
[[gnu::always_inline]] inline std::array<cv::v_float32x4, 2> BlendPairs(const uchar* grey,
                                                                        const int* offset,
                                                                        const float* share) {
  const cv::v_uint16x8 pairs(PairAt(grey + offset[0]), PairAt(grey + offset[1]),
                             PairAt(grey + offset[2]), PairAt(grey + offset[3]),
                             PairAt(grey + offset[4]), PairAt(grey + offset[5]),
                             PairAt(grey + offset[6]), PairAt(grey + offset[7]));
  const cv::v_int16x8 left = cv::v_reinterpret_as_s16(pairs & cv::v_setall_u16(0xff));
  const cv::v_int16x8 change = cv::v_reinterpret_as_s16(pairs >> 8) - left;
  std::array<cv::v_int32x4, 2> left_of, change_of;
  cv::v_expand(left, left_of[0], left_of[1]);
  cv::v_expand(change, change_of[0], change_of[1]);
  std::array<cv::v_float32x4, 2> blended;
  for (int half = 0; half < 2; ++half) {
    blended[half] = cv::v_cvt_f32(left_of[half]) +
                    cv::v_load(share + 4 * half) * cv::v_cvt_f32(change_of[half]);
  }
  return blended;
}

// Samples the image at A x + at for the pixels x of a patch of `side` x `side` pixels, row by row;
// returns false if they are not all inside the image.
PANGEA_VECTOR_CLONES
bool Sample(const cv::Mat& image, const Eigen::Vector2f& at, const Eigen::Matrix2f& a, int side,
            float* values) {
  const float half_side = static_cast<float>(side - 1) / 2.0F;
  const float reach_x = half_side * (std::abs(a(0, 0)) + std::abs(a(0, 1)));
  const float reach_y = half_side * (std::abs(a(1, 0)) + std::abs(a(1, 1)));
  if (!(at.x() - reach_x >= 0 && at.y() - reach_y >= 0 &&
        at.x() + reach_x < static_cast<float>(image.cols - 1) &&
        at.y() + reach_y < static_cast<float>(image.rows - 1))) {
    return false;
  }
  // Reads each row eight pixels at a time, and repeats its last pixel for those beyond it.
  const auto step = static_cast<int>(image.step);
  std::array<int, kPadded> offset;
  std::array<float, kPadded> fx, fy, grey;
  for (int v = 0; v < side; ++v) {
    const Eigen::Vector2f p0 =
        at + a * Eigen::Vector2f(-half_side, static_cast<float>(v) - half_side);
    for (int u = 0; u < kPadded; ++u) {
      const auto along = static_cast<float>(std::min(u, side - 1));
      const float px = p0.x() + along * a(0, 0);
      const float py = p0.y() + along * a(1, 0);
      const int x = static_cast<int>(px), y = static_cast<int>(py);
      fx[u] = px - static_cast<float>(x);
      fy[u] = py - static_cast<float>(y);
      offset[u] = y * step + x;
    }
    for (int u = 0; u < kPadded; u += 8) {
      const auto top = BlendPairs(image.data, &offset[u], &fx[u]);
      const auto bottom = BlendPairs(image.data + step, &offset[u], &fx[u]);
      for (int half = 0; half < 2; ++half) {
        const cv::v_float32x4 f = cv::v_load(&fy[u + 4 * half]);
        cv::v_store(&grey[u + 4 * half], top[half] + f * (bottom[half] - top[half]));
      }
    }
    std::memcpy(values + v * side, grey.data(), static_cast<size_t>(side) * sizeof(float));
  }
  return true;
}

}  // namespace

float ReferencePatch::Normalise(Values* values) {
  values->array() -= values->mean();
  const float length = values->norm();
  if (length < kMinContrast * kSize) {
    return 0;
  }
  *values /= length;
  return length;
}

std::optional<ReferencePatch> ReferencePatch::Take(const cv::Mat& image,
                                                   const Eigen::Vector2f& pixel) {
  ReferencePatch patch;
  // One pixel more on each side, for the derivatives.
  constexpr int kSide = kSize + 2;
  static_assert(kSide <= kPadded);
  using Square = Eigen::Array<float, kSide, kSide, Eigen::RowMajor>;
  Square values;
  if (!Sample(image, pixel, Eigen::Matrix2f::Identity(), kSide, values.data())) {
    return std::nullopt;
  }
  using Inner = Eigen::Array<float, kSize, kSize, Eigen::RowMajor>;
  const auto moved = [&values](int x, int y) -> Inner {
    return values.block<kSize, kSize>(1 + y, 1 + x);
  };
  patch.look_ = moved(0, 0).reshaped<Eigen::RowMajor>();
  const float length = Normalise(&patch.look_);
  if (length == 0) {
    return std::nullopt;
  }
  const Inner gx = (moved(1, 0) - moved(-1, 0)) / (2 * length);
  const Inner gy = (moved(0, 1) - moved(0, -1)) / (2 * length);
  for (int i = 0; i < kCount; ++i) {
    const int row = i / kSize;
    const float u = static_cast<float>(i - row * kSize) - kHalf;
    const float v = static_cast<float>(row) - kHalf;
    const float x = gx.data()[i], y = gy.data()[i];
    patch.jacobian_.row(i) << x, y, x * u, y * u, x * v, y * v;
  }
  // Normalising makes the patch independent of brightness and contrast; the derivative must be too.
  for (int column = 0; column < 6; ++column) {
    auto j = patch.jacobian_.col(column);
    j.array() -= j.mean();
    j -= patch.look_.dot(j) * patch.look_;
  }
  Eigen::Matrix<float, 6, 6> h = patch.jacobian_.transpose() * patch.jacobian_;
  h.diagonal().tail<4>().array() += kStiffness * kHalf * kHalf * (h(0, 0) + h(1, 1));
  h.diagonal().array() += kTiny;
  patch.gain_ = h.inverse();
  return patch;
}

std::optional<Eigen::Vector2f> ReferencePatch::Find(const cv::Mat& image,
                                                    const Eigen::Vector2f& guess) {
  Eigen::Matrix2f a = a_;
  Eigen::Vector2f at = guess;
  Values values;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    if (!Sample(image, at, a, kSize, values.data()) || Normalise(&values) == 0) {
      return std::nullopt;
    }
    const Eigen::Matrix<float, 6, 1> step = gain_ * (jacobian_.transpose() * (values - look_));
    // `step` would move the patch itself to look like the image; so the warp takes its inverse.
    Eigen::Matrix2f da;
    da << 1 + step[2], step[4], step[3], 1 + step[5];
    const Eigen::Matrix2f da_inverse = da.inverse();
    const Eigen::Vector2f move = a * (da_inverse * step.head<2>());
    a = a * da_inverse;
    at -= move;
    if (!((at - guess).squaredNorm() < kMaxCorrection_px * kMaxCorrection_px)) {
      return std::nullopt;
    }
    if (move.squaredNorm() < kConverged_px * kConverged_px) {
      break;
    }
  }
  // `values` were sampled before the last step, which is too small to matter.
  if (!(values.dot(look_) >= kMinCorrelation)) {
    return std::nullopt;
  }
  a_ = a;
  return at;
}

bool ReferencePatch::NeedsReplacement() const {
  const Eigen::Vector2f stretch = Eigen::JacobiSVD<Eigen::Matrix2f>(a_).singularValues();
  return !(stretch[0] < kMaxStretch && stretch[1] > kMinStretch);
}

}  // namespace pangea::vio
