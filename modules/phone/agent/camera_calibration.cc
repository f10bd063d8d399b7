#include "phone/agent/camera_calibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "calibration/calibrate.h"
#include "calibration/sensor_yaml.h"
#include "recording/euroc_calibration.h"

namespace pangea::phone {

CameraCalibration::CameraCalibration(int width, int height, const std::string& imu_yaml,
                                     const std::optional<Eigen::Quaterniond>& q_body_cam)
    : collector_(width, height, ParseEurocImuCalibration(imu_yaml, "imuYaml").noise, q_body_cam) {}

void CameraCalibration::AddImage(int64_t utime, const cv::Mat& image) {
  collector_.AddImage(utime, image);
  collector_.Forget(utime - kWindow_us);
}

CalibrationProgress CameraCalibration::progress() const {
  const calibration::Coverage coverage = calibration::RoughCoverage(collector_.input());
  const double time_share = std::min(1.0, coverage.seconds / calibration::kGood_s);
  int axis = 0;
  for (const int other : {1, 2}) {
    axis = coverage.RotationShare(other) < coverage.RotationShare(axis) ? other : axis;
  }
  CalibrationProgress progress;
  progress.share = coverage.Share();
  const std::vector<vio::TrackedFrame>& frames = collector_.input().frames;
  if (!frames.empty() && frames.back().observations.size() < calibration::kGoodPoints) {
    progress.missing = "points";
  } else if (coverage.RotationShare(axis) < time_share) {
    progress.missing = fmt::format("rotation about {}", "xyz"[axis]);
  } else if (time_share < 1) {
    progress.missing = "time";
  }
  return progress;
}

CameraCalibration::Outcome CameraCalibration::Solve() const {
  const calibration::Result result = calibration::Calibrate(collector_.input());
  if (!result.refused.empty()) {
    return {"", result.refused};
  }
  return {calibration::CameraYaml(result, result.image_rate_hz), ""};
}

}  // namespace pangea::phone
