#include "calibration/recording_tracks.h"

#include <fmt/format.h>

#include <iostream>

#include "files/progress.h"
#include "vio/front_end/tracker.h"

namespace pangea::calibration {
namespace {

// As wide as a guessed lens and an unknown rotation ask for; outliers that stay are dealt with by
// the robust loss.
vio::TrackerOptions Forgiving() {
  vio::TrackerOptions options;
  options.two_view.inlier_px = 4;
  options.two_view.rotation_sigma = 0.2;
  return options;
}

}  // namespace

Input TracksOf(const EurocRecording& recording, const PartOfRecording& part) {
  Input input;
  input.width = recording.camera().width;
  input.height = recording.camera().height;
  input.imu = recording.imu();
  input.imu_noise = recording.imu_noise();
  vio::Tracker tracker(recording.camera(), Forgiving());
  Progress progress("pangea-calibrate");
  const std::vector<EurocImage>& images = recording.images();
  for (size_t i = 0; i < images.size(); ++i) {
    const double at_s = 1e-6 * static_cast<double>(images[i].utime - images.front().utime);
    if (at_s < part.start_s || at_s > part.start_s + part.duration_s) {
      continue;
    }
    std::string why;
    const cv::Mat image = recording.LoadImage(i, &why);
    if (image.empty()) {
      std::cerr << fmt::format("pangea-calibrate: {}\n", why);
      continue;
    }
    input.frames.push_back(tracker.Track(images[i].utime, image, Eigen::Quaterniond::Identity()));
    progress.Update(static_cast<int64_t>(i), static_cast<int64_t>(images.size()), "images");
  }
  return input;
}

}  // namespace pangea::calibration
