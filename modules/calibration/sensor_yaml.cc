#include "calibration/sensor_yaml.h"

#include <fmt/format.h>

#include <cmath>

namespace pangea::calibration {
namespace {

constexpr double kTranslationSigma_m = 0.05;

// T_BS in EuRoC's format.
std::string Matrix(const Rigid3& T) {
  const Eigen::Matrix3d R = T.q.toRotationMatrix();
  std::string data;
  for (int row = 0; row < 3; ++row) {
    data +=
        fmt::format("{:.9f}, {:.9f}, {:.9f}, {:.9g}, ", R(row, 0), R(row, 1), R(row, 2), T.t[row]);
  }
  return fmt::format("T_BS:\n  cols: 4\n  rows: 4\n  data: [{}0, 0, 0, 1]\n", data);
}

std::string List(const Eigen::Vector3d& v) {
  return fmt::format("[{:.6g}, {:.6g}, {:.6g}]", v.x(), v.y(), v.z());
}

}  // namespace

std::string CameraYaml(const Result& result, double rate_hz, const Rigid3& T_s_body) {
  const CameraModel& c = result.parameters.camera;
  const Tangent& sigma = result.sigma;
  const bool fisheye = c.kind == CameraModel::Kind::kEquidistant;
  std::string text = "sensor_type: camera\n" + Matrix(T_s_body * c.T_body_cam);
  text += fmt::format("rotation_sigma: {}  # rad, about the body's axes\n",
                      List(sigma.segment<3>(kRotation)));
  text += fmt::format("translation_sigma: {}  # m: not estimated\n", kTranslationSigma_m);
  text += fmt::format("rate_hz: {:.4g}\nresolution: [{}, {}]\ncamera_model: pinhole\n", rate_hz,
                      c.width, c.height);
  text += fmt::format("intrinsics: [{:.3f}, {:.3f}, {:.3f}, {:.3f}]\n", c.fx, c.fy, c.cx, c.cy);
  text += fmt::format("intrinsics_sigma: [{0:.3g}, {0:.3g}, {1:.3g}, {2:.3g}]  # px\n",
                      c.fx * sigma[kLogFocal], sigma[kCentre], sigma[kCentre + 1]);
  text += fmt::format("distortion_model: {}\n", fisheye ? "equidistant" : "radial-tangential");
  text += fmt::format("distortion_coefficients: [{:.6f}, {:.6f}, 0, 0]\n", c.distortion[0],
                      c.distortion[1]);
  text += fmt::format("distortion_sigma: [{:.3g}, {:.3g}]  # of the first two\n",
                      sigma[kDistortion], sigma[kDistortion + 1]);
  text += fmt::format("time_offset_s: {:.6f}  # of the first row: t_imu = t_image + offset\n",
                      c.time_offset_s);
  text += fmt::format("time_offset_sigma: {:.3g}  # of the middle row, at any exposure\n",
                      std::hypot(sigma[kTimeOffset], result.time_offset_spread_s));
  text += fmt::format("readout_s: {:.6f}\nreadout_sigma: {:.3g}\n", c.readout_s, sigma[kReadout]);
  return text;
}

std::string ImuYaml(const Result& result, const ImuNoise& noise, const Rigid3& T_s_body) {
  std::string text = "sensor_type: imu\n" + Matrix(T_s_body);
  text += fmt::format("rate_hz: {:.4g}\n", noise.rate_hz);
  text += fmt::format("gyroscope_noise_density: {:.6g}\ngyroscope_random_walk: {:.6g}\n",
                      noise.gyro_noise_density, noise.gyro_random_walk);
  text += fmt::format("accelerometer_noise_density: {:.6g}\naccelerometer_random_walk: {:.6g}\n",
                      noise.accel_noise_density, noise.accel_random_walk);
  text += fmt::format("gyroscope_scale_sigma: {:.6g}\naccelerometer_scale_sigma: {:.6g}\n",
                      noise.gyro_scale_sigma, noise.accel_scale_sigma);
  text += fmt::format("axes_sigma: {:.6g}\n", noise.axes_sigma);
  text += fmt::format("gyroscope_bias: {}  # rad/s\ngyroscope_bias_sigma: {}\n",
                      List(result.parameters.gyro_bias), List(result.sigma.segment<3>(kGyroBias)));
  return text;
}

}  // namespace pangea::calibration
