#include "calibration/summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "calibration/parameters.h"
#include "calibration/priors.h"
#include "calibration/search.h"
#include "core/axis_aligned.h"

namespace pangea::calibration {
namespace {

constexpr double kRough_px = 1.0;
// Relative to the prior's sigma: above it, the data gave no information
constexpr double kTold = 0.7;
constexpr char kAxisNames[] = {'x', 'y', 'z'};
constexpr const char* kAxes[] = {"up and down (the camera's x axis)",
                                 "left and right (the camera's y axis)", "about the line of sight"};

std::string Row(const std::string& what, const std::string& value, const std::string& sigma,
                bool told = true) {
  return fmt::format("{:<34} {:>28} ± {}{}\n", what, value, sigma,
                     told ? "" : "  (not told by the motion: as assumed)");
}

std::string Values(const Input& input, const Result& result) {
  const CameraModel& c = result.parameters.camera;
  const Tangent& s = result.sigma;
  const bool fisheye = c.kind == CameraModel::Kind::kEquidistant;
  const double field = FieldOfView(c) / kDegree;
  const Eigen::Vector3d rotation = s.segment<3>(kRotation) / kDegree;
  const double centre_prior = kSigmaCentre * std::max(input.width, input.height);
  std::string text;
  text += Row("focal length, px", fmt::format("{:.1f} ({:.1f} degrees)", c.fx, field),
              fmt::format("{:.2f} %", 100 * s[kLogFocal]));
  text += Row("principal point, px", fmt::format("{:.1f}, {:.1f}", c.cx, c.cy),
              fmt::format("{:.1f}, {:.1f}", s[kCentre], s[kCentre + 1]),
              s.segment<2>(kCentre).maxCoeff() < kTold * centre_prior);
  text += Row(fisheye ? "distortion (equidistant)" : "distortion (radial-tangential)",
              fmt::format("{:.4f}, {:.4f}", c.distortion[0], c.distortion[1]),
              fmt::format("{:.4f}, {:.4f}", s[kDistortion], s[kDistortion + 1]),
              s[kDistortion] < kTold * PriorOf(input, result.parameters).sigma[kDistortion]);
  const Eigen::Matrix3d R = c.T_body_cam.R();
  for (int axis = 0; axis < 3; ++axis) {
    text += Row(fmt::format("camera's {} in the IMU's axes", kAxisNames[axis]),
                fmt::format("{:.4f} {:.4f} {:.4f}", R(0, axis), R(1, axis), R(2, axis)),
                fmt::format("{:.2f} degrees", rotation.norm()));
  }
  text += Row("time offset, ms (middle row)",
              fmt::format("{:.1f}", 1e3 * result.parameters.MiddleRowOffset_s()),
              fmt::format("{:.2f}", 1e3 * s[kTimeOffset]));
  if (s[kIntervalShare] < kTold * kSigmaIntervalShare) {
    text += Row("  per change of the image interval",
                fmt::format("{:.2f}", result.parameters.interval_share),
                fmt::format("{:.2f}", s[kIntervalShare]));
  }
  text += Row("read-out, ms", fmt::format("{:.1f}", 1e3 * c.readout_s),
              fmt::format("{:.1f}", 1e3 * s[kReadout]), s[kReadout] < kTold * kSigmaReadout_s);
  const Eigen::Vector3d& bias = result.parameters.gyro_bias;
  text += Row("gyroscope bias, rad/s",
              fmt::format("{:.4f} {:.4f} {:.4f}", bias.x(), bias.y(), bias.z()),
              fmt::format("{:.4f}", s.segment<3>(kGyroBias).maxCoeff()));
  return text;
}

std::vector<std::string> Advice(const Result& result) {
  std::vector<std::string> advice;
  if (result.better_q_body_cam) {
    advice.push_back(fmt::format("--camera-axes={}, or none", AxesOf(*result.better_q_body_cam)));
  }
  for (int axis = 0; axis < 3; ++axis) {
    if (result.sigma_px > 0 && result.coverage.rotation_rms[axis] < kGoodRotation) {
      advice.push_back(fmt::format("rotate more {}: {:.2f} rad/s", kAxes[axis],
                                   result.coverage.rotation_rms[axis]));
    }
  }
  if (result.coverage.seconds < kGood_s) {
    advice.push_back(fmt::format("record longer: {:.0f} s of it could be used, 30 are good",
                                 result.coverage.seconds));
  }
  if (result.coverage.points > 0 && result.coverage.points < kGoodPoints) {
    advice.push_back(
        fmt::format("more light, or more to see: {:.0f} points could be followed, 50 are good",
                    result.coverage.points));
  }
  if (result.sigma_px > kRough_px) {
    advice.push_back(fmt::format(
        "more light and no image stabilisation: points are {:.1f} px off, 0.5 is good (blur, or "
        "stamps that jitter)",
        result.sigma_px));
  }
  return advice;
}

}  // namespace

std::string Summary(const Input& input, const Result& result) {
  std::string text;
  if (!result.refused.empty()) {
    text += fmt::format("no calibration: {}\n", result.refused);
  }
  if (result.sigma_px > 0) {
    text += Values(input, result);
    text += fmt::format(
        "{:.0f} s, {:.0f} points in a pair of images, {:.2f} px off, {:.0f} % within three "
        "standard deviations\n",
        result.coverage.seconds, result.coverage.points, result.sigma_px,
        100 * result.inlier_share);
    if (result.next_cost > 0) {
      text += fmt::format("the next best rotation of the camera fits {:.1f} times worse\n",
                          result.next_cost);
    }
  }
  for (const std::string& line : Advice(result)) {
    text += "better: " + line + "\n";
  }
  return text;
}

}  // namespace pangea::calibration
