#include "sim/schedule.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "files/csv.h"
#include "sim/euroc_writer.h"

namespace pangea::sim {

Schedule MakeSchedule(const Span& span, double imu_rate_hz, double image_rate_hz) {
  Schedule schedule{{}, span};
  const int64_t period = std::llround(1e9 / imu_rate_hz);
  const int64_t every = std::max<int64_t>(1, std::llround(imu_rate_hz / image_rate_hz));
  for (int64_t t = span.begin_ns + period; t + period <= span.end_ns; t += every * period) {
    schedule.images_ns.push_back(t);
  }
  if (schedule.images_ns.empty()) {
    throw std::runtime_error(fmt::format("nothing to record: {:.3f} s are too short for an image",
                                         1e-9 * static_cast<double>(span.end_ns - span.begin_ns)));
  }
  return schedule;
}

std::string RecordedImu::Text(const Span& span) const {
  std::string text = EurocWriter::kImuHeader;
  for (size_t i = 0; i < rows.size(); ++i) {
    if (stamps_ns[i] >= span.begin_ns && stamps_ns[i] <= span.end_ns) {
      text += rows[i] + '\n';
    }
  }
  return text;
}

std::vector<int64_t> RecordedImu::Stamps(const Span& span) const {
  std::vector<int64_t> stamps;
  std::ranges::copy_if(stamps_ns, std::back_inserter(stamps), [&](int64_t stamp) {
    return stamp >= span.begin_ns && stamp <= span.end_ns;
  });
  return stamps;
}

RecordedImu ReadRecordedImu(const std::string& path) {
  RecordedImu imu;
  for (const CsvRow& row : ReadCsv(path)) {
    int64_t ns = 0;
    if (row.fields.size() != 7 || !ParseNumber(row.fields[0], &ns)) {
      throw std::runtime_error(
          fmt::format("{}:{}: not 'nanoseconds, gyro x y z, accel x y z'", path, row.line));
    }
    imu.stamps_ns.push_back(ns);
    imu.rows.push_back(fmt::format("{}", fmt::join(row.fields, ",")));
  }
  if (!std::ranges::is_sorted(imu.stamps_ns) || imu.stamps_ns.empty()) {
    throw std::runtime_error(fmt::format("{}: must hold rows in order of time", path));
  }
  return imu;
}

Schedule ReadSchedule(const std::string& stamps_file, const Span& span, const RecordedImu& imu) {
  Schedule schedule;
  const int64_t begin = std::max(span.begin_ns, imu.stamps_ns.front());
  const int64_t end = std::min(span.end_ns, imu.stamps_ns.back());
  for (const CsvRow& row : ReadCsv(stamps_file)) {
    int64_t ns = 0;
    if (!ParseNumber(row.fields[0], &ns)) {
      throw std::runtime_error(
          fmt::format("{}:{}: not a stamp in nanoseconds", stamps_file, row.line));
    }
    if (ns >= begin && ns <= end) {
      schedule.images_ns.push_back(ns);
    }
  }
  if (schedule.images_ns.empty()) {
    throw std::runtime_error(
        fmt::format("{}: no stamp lies within both the path's and the IMU's time", stamps_file));
  }
  std::ranges::sort(schedule.images_ns);
  schedule.images_ns.erase(std::unique(schedule.images_ns.begin(), schedule.images_ns.end()),
                           schedule.images_ns.end());
  constexpr int64_t kAround = 10'000'000;
  schedule.imu = {schedule.images_ns.front() - kAround, schedule.images_ns.back() + kAround};
  return schedule;
}

}  // namespace pangea::sim
