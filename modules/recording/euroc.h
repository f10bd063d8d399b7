#pragma once

// A recording in EuRoC's on-disk format: mav0/cam0 (images, sensor.yaml), mav0/imu0 and, if there
// is one, mav0/state_groundtruth_estimate0 (or TUM-VI's mocap0). Times become microseconds, rounded
// down; file names keep their nanoseconds. `body` is the IMU. Images are loaded only by LoadImage.
//
// A fault either makes the recording unusable, and the constructor throws an error that names file,
// line or field and says what to do; or it is repaired and named in warnings(). docs/recordings.md
// lists the faults and the optional keys of sensor.yaml.

#include <cstdint>
#include <filesystem>
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
  int64_t stamp_ns = 0;  // nanoseconds, as in the csv
  std::string path;
};

class EurocRecording {
 public:
  // `folder` contains mav0 or is mav0 itself. Throws std::runtime_error if the recording is
  // unusable.
  explicit EurocRecording(const std::string& folder);

  const std::string& mav0() const { return mav0_; }
  const CameraModel& camera() const { return camera_; }
  // Nothing if sensor.yaml has no such keys.
  const std::optional<CalibrationSigmas>& calibration_sigmas() const { return calibration_sigmas_; }
  const ImuNoise& imu_noise() const { return imu_noise_; }
  const std::vector<EurocImage>& images() const { return images_; }
  const std::vector<ImuSample>& imu() const { return imu_; }
  // Poses T_reference_body; empty when there is no ground truth.
  const Trajectory& ground_truth() const { return ground_truth_; }
  const std::vector<std::string>& warnings() const { return warnings_; }

  // Loads an image as 8-bit grey of the calibration's size. Empty, with the reason in `why`, when
  // the file cannot be read, is not PNG or JPEG, is corrupt, or has another size (grey_image.h).
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

// The recording's folder: `wanted`, or the only recording beside it whose name continues it (MH_01
// finds MH_01_easy). Nothing if there is none, or more than one.
std::optional<std::filesystem::path> FindRecording(const std::filesystem::path& wanted);

// Reads only the ground truth; empty when the recording has none.
Trajectory ReadEurocGroundTruthOf(const std::string& folder, std::vector<std::string>* warnings);
// Time stamp of the first image in the csv, microseconds; nothing when it cannot be read.
std::optional<int64_t> FirstImageUtimeOf(const std::string& folder);

}  // namespace pangea
