#include "sim/render/sensor.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "sim/random.h"

namespace pangea::sim {
namespace {

using Eigen::Vector3f;

float BilinearAt(const cv::Mat& image, float x, float y) {
  x = std::clamp(x, 0.0f, static_cast<float>(image.cols - 1));
  y = std::clamp(y, 0.0f, static_cast<float>(image.rows - 1));
  const int x0 = std::min(static_cast<int>(x), image.cols - 2);
  const int y0 = std::min(static_cast<int>(y), image.rows - 2);
  const float fx = x - static_cast<float>(x0);
  const float fy = y - static_cast<float>(y0);
  const float* a = image.ptr<float>(y0) + x0;
  const float* b = image.ptr<float>(y0 + 1) + x0;
  const float top = a[0] + fx * (a[1] - a[0]);
  const float bottom = b[0] + fx * (b[1] - b[0]);
  return top + fy * (bottom - top);
}

// Slow changes of exposure within +- variation: three incommensurate waves with phases that depend
// on the seed.
double ExposureGain(double variation, uint64_t seed, double time_s) {
  Rng rng(seed, "exposure");
  double sum = 0;
  for (const double period_s : {7.0, 17.0, 41.0}) {
    sum += std::sin(2 * M_PI * (time_s / period_s + rng.Uniform())) / 3;
  }
  return 1.0 + variation * sum;
}

}  // namespace

Sensor::Sensor(const CameraModel& camera, const SensorOptions& options)
    : options_(options), vignette_(camera.height, camera.width, CV_32F) {
  const Eigen::Vector2d centre(0.5 * (camera.width - 1), 0.5 * (camera.height - 1));
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const double r2 = (Eigen::Vector2d(x, y) - centre).squaredNorm() / centre.squaredNorm();
      vignette_.at<float>(y, x) =
          static_cast<float>(1 - options.vignetting * r2 * (0.5 + 0.5 * r2));
      const auto xy = camera.Unproject({x, y});
      Eigen::Matrix<double, 2, 3> J = Eigen::Matrix<double, 2, 3>::Zero();
      Eigen::Vector3d ray = Eigen::Vector3d::UnitZ();
      if (xy) {
        ray = xy->homogeneous().normalized();
        camera.Project(ray, &J);
      }
      ray_.emplace_back(ray.cast<float>());
      J_pixel_ray_.emplace_back(J.cast<float>());
    }
  }
  Rng rng(0, "normal table");
  normals_.resize(1 << 16);
  for (float& value : normals_) {
    value = static_cast<float>(rng.Normal());
  }
}

cv::Mat Sensor::Blurred(const RenderedView& view, const CameraRates& rates) const {
  cv::Mat blurred(view.grey.size(), CV_32F);
  const Vector3f rotation = (options_.exposure_s * rates.omega_cam).cast<float>();
  const Vector3f move = (options_.exposure_s * rates.v_cam).cast<float>();
  size_t i = 0;
  for (int y = 0; y < blurred.rows; ++y) {
    const float* in = view.grey.ptr<float>(y);
    const float* range = view.range.ptr<float>(y);
    float* out = blurred.ptr<float>(y);
    for (int x = 0; x < blurred.cols; ++x, ++i) {
      // A stationary point p moves by -(omega x p + v) in the camera's frame; with p = range * ray.
      const Vector3f shift = -rotation.cross(ray_[i]) - move / range[x];
      const Eigen::Vector2f flow = J_pixel_ray_[i] * shift;
      const float length = flow.norm();
      if (length < 0.25f) {
        out[x] = in[x];
        continue;
      }
      const int taps = std::clamp(static_cast<int>(std::ceil(1.5f * length)), 2, 32);
      float sum = 0;
      for (int tap = 0; tap < taps; ++tap) {
        const float s = (static_cast<float>(tap) + 0.5f) / static_cast<float>(taps) - 0.5f;
        sum += BilinearAt(view.grey, static_cast<float>(x) + s * flow.x(),
                          static_cast<float>(y) + s * flow.y());
      }
      out[x] = sum / static_cast<float>(taps);
    }
  }
  return blurred;
}

cv::Mat Sensor::NoiseFree(const RenderedView& view, const CameraRates& rates) const {
  const cv::Mat light = options_.exposure_s > 0 ? Blurred(view, rates) : view.grey;
  cv::Mat picture;
  cv::Mat(light.mul(vignette_)).convertTo(picture, CV_8U);
  return picture;
}

cv::Mat Sensor::Develop(const cv::Mat& noise_free, uint64_t seed, double time_s,
                        uint64_t frame) const {
  const double gain = options_.brightness * ExposureGain(options_.gain_variation, seed, time_s);
  std::array<float, 256> grey;
  std::array<float, 256> sigma;
  for (size_t i = 0; i < grey.size(); ++i) {
    grey[i] = static_cast<float>(gain * static_cast<double>(i));
    sigma[i] = static_cast<float>(
        std::sqrt(options_.read_noise * options_.read_noise +
                  options_.shot_noise * options_.shot_noise * static_cast<double>(grey[i])));
  }
  cv::Mat picture(noise_free.size(), CV_8U);
  uint64_t counter = Mix(Mix(seed) ^ Mix(frame + 0x51ull));
  for (int y = 0; y < picture.rows; ++y) {
    const uint8_t* in = noise_free.ptr(y);
    uint8_t* out = picture.ptr(y);
    uint64_t bits = 0;
    for (int x = 0; x < picture.cols; ++x) {
      bits = x % 4 == 0 ? Mix(counter++) : bits >> 16;
      const float value = grey[in[x]] + sigma[in[x]] * normals_[bits & 0xFFFF];
      out[x] = static_cast<uint8_t>(std::clamp(value + 0.5f, 0.0f, 255.0f));
    }
  }
  return picture;
}

}  // namespace pangea::sim
