#pragma once

// The stamps of a recording: generated, or taken from a recorded camera and IMU.

#include <cstdint>
#include <string>
#include <vector>

namespace pangea::sim {

struct Span {
  int64_t begin_ns = 0;
  int64_t end_ns = 0;
};

struct Schedule {
  std::vector<int64_t> images_ns;
  Span imu;  // span of the IMU samples, which contains the images
};

// Every image has the stamp of an IMU sample, as in EuRoC, with a sample before and after it.
// Throws std::runtime_error if the span is too short for an image.
Schedule MakeSchedule(const Span& span, double imu_rate_hz, double image_rate_hz);

// A recorded IMU, with the rows of its file unchanged.
struct RecordedImu {
  std::vector<int64_t> stamps_ns;
  std::vector<std::string> rows;

  // The rows within the span, under EuRoC's header.
  std::string Text(const Span& span) const;
  std::vector<int64_t> Stamps(const Span& span) const;
};

// Both throw std::runtime_error with file and line.
RecordedImu ReadRecordedImu(const std::string& path);
// The stamps of the file within the span and the time of the IMU.
Schedule ReadSchedule(const std::string& stamps_file, const Span& span, const RecordedImu& imu);

}  // namespace pangea::sim
