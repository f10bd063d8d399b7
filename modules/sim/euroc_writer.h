#pragma once

// Writes a recording in EuRoC's on-disk format: the sensors' folders, yaml and csv files. It has
// another name until it is complete: half a recording would be played like a whole one.

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "core/camera_model.h"
#include "core/imu/imu.h"
#include "sim/imu_simulator.h"

namespace pangea::sim {

class EurocWriter {
 public:
  static constexpr const char* kImuHeader =
      "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
      "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n";

  // Begins a recording in `folder`. Throws if it contains a recording already.
  explicit EurocWriter(const std::string& folder);
  // Continues a recording that was begun.
  static EurocWriter Begun(const std::string& folder);
  // The recording is complete: it becomes `folder`/mav0.
  void Finish() const;

  void WriteBody(const std::string& comment) const;
  void WriteCamera(const CameraModel& camera, double rate_hz, const std::string& comment) const;
  void WriteImuCalibration(const ImuNoise& noise) const;
  void WriteImu(const SimulatedImu& imu) const;
  // 17 columns with the biases of `imu`; 8 columns if `imu` is null.
  void WriteGroundTruth(const SplinePath& path, const std::vector<int64_t>& stamps_ns,
                        const SimulatedImu* imu) const;
  void WriteImageList(const std::vector<int64_t>& stamps_ns) const;
  // Thread-safe.
  void WriteImage(int64_t stamp_ns, const cv::Mat& image) const;
  void WriteText(const std::string& file, const std::string& text) const;

 private:
  EurocWriter() = default;
  std::string complete_;
  std::string mav0_;  // where it is written
};

// 8-bit PNG with the fastest compression; throws if it cannot be written.
void WritePng(const std::string& path, const cv::Mat& image);

}  // namespace pangea::sim
