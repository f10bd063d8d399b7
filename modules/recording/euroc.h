#pragma once

// A recording in EuRoC's on-disk format, read as it is: mav0/cam0 (images, sensor.yaml), mav0/imu0,
// and, where there is one, mav0/state_groundtruth_estimate0 (or TUM-VI's mocap0).
// Times become microseconds, rounded down; file names keep their nanoseconds. `body` is the IMU.
// Images are read when asked for.
//
// What is wrong with a recording either makes it unusable (the constructor throws, naming file,
// line or field, and the mend) or is mended and named in warnings(): docs/recordings.md has the
// table, and the optional keys of sensor.yaml.

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/calibration_sigmas.h"
#include "core/camera_model.h"
#include "core/imu/imu.h"
#include "recording/trajectory.h"

namespace pangea {

struct EurocImage {
  int64_t utime = 0;     // microseconds
  int64_t stamp_ns = 0;  // as in the csv
  std::string path;
};

class EurocRecording {
 public:
  // `folder` holds mav0 or is mav0. Throws std::runtime_error as in that table.
  explicit EurocRecording(const std::string& folder);

  const std::string& mav0() const { return mav0_; }
  const CameraModel& camera() const { return camera_; }
  // Where sensor.yaml says it.
  const std::optional<CalibrationSigmas>& calibration_sigmas() const { return calibration_sigmas_; }
  const ImuNoise& imu_noise() const { return imu_noise_; }
  const std::vector<EurocImage>& images() const { return images_; }
  const std::vector<ImuSample>& imu() const { return imu_; }
  // T_reference_body; empty when there is none.
  const Trajectory& ground_truth() const { return ground_truth_; }
  const std::vector<std::string>& warnings() const { return warnings_; }

  // 8-bit grey, of the calibration's size; empty, with the reason in `why`, when the file cannot be
  // read, is neither PNG nor JPEG, is corrupt or of another size (grey_image.h).
  cv::Mat LoadImage(size_t index, std::string* why) const;

 private:
  void ReadCamera();
  Rigid3 ReadImuCalibration();
  void ReadImages();
  void ReadImu();
  void DropImagesOutsideImu();
  void CheckImages() const;

  std::string mav0_;
  CameraModel camera_;
  std::optional<CalibrationSigmas> calibration_sigmas_;
  ImuNoise imu_noise_;
  std::vector<EurocImage> images_;
  std::vector<ImuSample> imu_;
  Trajectory ground_truth_;
  std::vector<std::string> warnings_;
};

// The ground truth alone, without opening the rest: empty when the recording has none.
Trajectory ReadEurocGroundTruthOf(const std::string& folder, std::vector<std::string>* warnings);
// Stamp of the first image in the csv; nothing when there is none to be read.
std::optional<int64_t> FirstImageUtimeOf(const std::string& folder);

}  // namespace pangea
