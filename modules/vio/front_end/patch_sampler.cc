#include "vio/front_end/patch_sampler.h"

#include <algorithm>
#include <cmath>

namespace pangea::vio {
namespace {

constexpr int kShift = 16;  // positions are in 1 / 65536 pixel
constexpr int kFractionShift = 8;
constexpr int kFraction = 1 << kFractionShift;  // of a pixel, in the interpolation
// Shorter than this, the part of gravity in the image plane says little of the roll: the camera
// looks up or down to within 6 degrees.
constexpr double kMinInPlane = 0.1;

int32_t Fixed(double value) { return static_cast<int32_t>(std::lround(value * (1 << kShift))); }

}  // namespace

PatchSampler::PatchSampler(const Eigen::Vector3d& down_cam) {
  const double in_plane = std::sqrt(down_cam.x() * down_cam.x() + down_cam.y() * down_cam.y());
  const bool known = in_plane > kMinInPlane * std::sqrt(down_cam.squaredNorm());
  cos_ = known ? down_cam.y() / in_plane : 1;
  sin_ = known ? -down_cam.x() / in_plane : 0;
}

PatchNetwork::Patch PatchSampler::Sample(const cv::Mat& level, const cv::Point2f& centre,
                                         double step) const {
  constexpr int kSide = PatchNetwork::kPatchSide;
  const int32_t centre_x = Fixed(centre.x), centre_y = Fixed(centre.y);
  const int32_t cos = Fixed(step * cos_), sin = Fixed(step * sin_);
  const int max_x = level.cols - 1, max_y = level.rows - 1;
  PatchNetwork::Patch patch;
  auto out = patch.begin();
  for (int v = 0; v < kSide; ++v) {
    for (int u = 0; u < kSide; ++u, ++out) {
      // Twice the offset from the patch's middle, which lies between two pixels.
      const int32_t du = 2 * u - (kSide - 1), dv = 2 * v - (kSide - 1);
      const int32_t x = centre_x + (cos * du - sin * dv) / 2;
      const int32_t y = centre_y + (sin * du + cos * dv) / 2;
      const int x0 = x >> kShift, y0 = y >> kShift;
      const int fx = (x >> (kShift - kFractionShift)) & (kFraction - 1);
      const int fy = (y >> (kShift - kFractionShift)) & (kFraction - 1);
      const int left = std::clamp(x0, 0, max_x), right = std::clamp(x0 + 1, 0, max_x);
      const uint8_t* const upper = level.ptr<uint8_t>(std::clamp(y0, 0, max_y));
      const uint8_t* const lower = level.ptr<uint8_t>(std::clamp(y0 + 1, 0, max_y));
      const int top = upper[left] * (kFraction - fx) + upper[right] * fx;
      const int bottom = lower[left] * (kFraction - fx) + lower[right] * fx;
      *out = static_cast<uint8_t>((top * (kFraction - fy) + bottom * fy + (1 << 15)) >> 16);
    }
  }
  return patch;
}

}  // namespace pangea::vio
