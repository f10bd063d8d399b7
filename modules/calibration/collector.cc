#include "calibration/collector.h"

#include <vector>

#include "calibration/priors.h"

namespace pangea::calibration {
namespace {

// Tolerances for a guessed lens and an unknown rotation; the robust loss handles the remaining
// outliers.
vio::TrackerOptions Forgiving() {
  vio::TrackerOptions options;
  options.two_view.inlier_px = 4;
  options.two_view.rotation_sigma = 0.2;
  return options;
}

Input Empty(int width, int height, const ImuNoise& noise,
            const std::optional<Eigen::Quaterniond>& q_body_cam) {
  Input input;
  input.width = width;
  input.height = height;
  input.imu_noise = noise;
  input.q_body_cam = q_body_cam;
  return input;
}

}  // namespace

Collector::Collector(int width, int height, const ImuNoise& noise,
                     const std::optional<Eigen::Quaterniond>& q_body_cam)
    : input_(Empty(width, height, noise, q_body_cam)),
      tracker_(GuessedCamera(width, height), Forgiving()),
      repeated_images_(GuessedCamera(width, height)) {}

void Collector::AddImu(const ImuSample& sample) {
  if (IsPlausible(sample) && (input_.imu.empty() || sample.utime > input_.imu.back().utime)) {
    input_.imu.push_back(sample);
  }
}

void Collector::AddImage(int64_t utime, const cv::Mat& image) {
  if (!input_.frames.empty() && utime <= input_.frames.back().utime) {
    return;
  }
  // The camera's rotation is not known yet: only equal pixels and the features' speed tell.
  const auto unknown = Eigen::Quaterniond::Identity();
  if (repeated_images_.IsRepeat(utime, image, unknown, 0)) {
    return;
  }
  input_.frames.push_back(tracker_.Track(utime, image, unknown));
  repeated_images_.NoteNew(image, input_.frames.back());
}

void Collector::Forget(int64_t before_utime) {
  const auto is_before = [before_utime](const auto& item) { return item.utime < before_utime; };
  std::erase_if(input_.frames, is_before);
  std::erase_if(input_.imu, is_before);
}

}  // namespace pangea::calibration
