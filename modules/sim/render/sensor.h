#pragma once

// Converts the light on the sensor to the image: vignetting and motion blur (the noise-free frame,
// which depends only on path and scene), then exposure changes and noise (which depend on the
// seed).

#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "core/camera_model.h"
#include "sim/render/renderer.h"

namespace pangea::sim {

struct SensorOptions {
  double exposure_s = 0.003;    // motion blur; 0: none
  double brightness = 1.0;      // mean gain of the image
  double vignetting = 0.35;     // share of light lost in the corners
  double gain_variation = 0.2;  // slow exposure changes, +- share
  double read_noise = 1.0;      // grey levels
  double shot_noise = 0.12;     // grey levels at grey 1, grows with the root of the grey
};

// How a camera moves during one exposure, in its own frame.
struct CameraRates {
  Eigen::Vector3d omega_cam = Eigen::Vector3d::Zero();  // rad/s
  Eigen::Vector3d v_cam = Eigen::Vector3d::Zero();      // m/s
};

class Sensor {
 public:
  Sensor(const CameraModel& camera, const SensorOptions& options);

  // 8-bit image of the view, with motion blur.
  cv::Mat NoiseFree(const RenderedView& view, const CameraRates& rates) const;
  // Adds exposure and noise; `seed`, `time_s` and `frame` determine the random numbers.
  cv::Mat Develop(const cv::Mat& noise_free, uint64_t seed, double time_s, uint64_t frame) const;

 private:
  cv::Mat Blurred(const RenderedView& view, const CameraRates& rates) const;

  SensorOptions options_;
  cv::Mat vignette_;                  // CV_32F, at most 1
  std::vector<Eigen::Vector3f> ray_;  // unit
  // d(pixel)/d(point on the unit sphere around the camera)
  std::vector<Eigen::Matrix<float, 2, 3>> J_pixel_ray_;
  std::vector<float> normals_;  // a table of standard normal draws
};

}  // namespace pangea::sim
