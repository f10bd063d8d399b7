#pragma once

// Which stamps a recording has, made up or taken from a recorded camera and IMU.

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
  Span imu;  // around the images
};

// Every image's stamp is also an IMU sample's, as in EuRoC, and has a sample on either side.
Schedule MakeSchedule(const Span& span, double imu_rate_hz, double image_rate_hz);

// A recorded IMU, its rows as they stand in the file.
struct RecordedImu {
  std::vector<int64_t> stamps_ns;
  std::vector<std::string> rows;

  // The rows within the span, under EuRoC's header.
  std::string Text(const Span& span) const;
  std::vector<int64_t> Stamps(const Span& span) const;
};

// Both throw std::runtime_error naming file and line.
RecordedImu ReadRecordedImu(const std::string& path);
// The stamps of the file that lie within the span and the IMU's time.
Schedule ReadSchedule(const std::string& stamps_file, const Span& span, const RecordedImu& imu);

}  // namespace pangea::sim
