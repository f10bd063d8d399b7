#include "calibration/recording_tracks.h"

#include <fmt/format.h>

#include <iostream>

#include "calibration/collector.h"
#include "files/progress.h"

namespace pangea::calibration {
Input TracksOf(const EurocRecording& recording, const PartOfRecording& part,
               const std::optional<Eigen::Quaterniond>& q_body_cam) {
  Collector collector(recording.camera().width, recording.camera().height, recording.imu_noise(),
                      q_body_cam);
  for (const ImuSample& sample : recording.imu()) {
    collector.AddImu(sample);
  }
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
    collector.AddImage(images[i].utime, image);
    progress.Update(static_cast<int64_t>(i), static_cast<int64_t>(images.size()), "images");
  }
  return collector.input();
}

}  // namespace pangea::calibration
