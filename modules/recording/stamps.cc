#include "recording/stamps.h"

#include <fmt/format.h>

#include <cmath>

#include "core/median.h"

namespace pangea {
namespace {

// If more than this share of all periods are long, they are no gaps: the stamps come in bursts.
constexpr double kMaxShareOfGaps = 0.1;
constexpr size_t kFewestStamps = 10;  // for a rate
// A camera's rate follows its exposure; drivers round it.
constexpr double kSameRate = 0.1;

std::vector<int64_t> PeriodsOf(const std::vector<int64_t>& utimes) {
  std::vector<int64_t> periods;
  for (size_t i = 1; i < utimes.size(); ++i) {
    periods.push_back(utimes[i] - utimes[i - 1]);
  }
  return periods;
}

// The stamps that do not follow another one at once.
std::vector<int64_t> BeginsOfBursts(const std::vector<int64_t>& utimes, double limit_us) {
  std::vector<int64_t> begins = {utimes.front()};
  for (size_t i = 1; i < utimes.size(); ++i) {
    if (static_cast<double>(utimes[i] - utimes[i - 1]) > limit_us) {
      begins.push_back(utimes[i]);
    }
  }
  return begins;
}

// The usual period, microseconds: the median, or that of the bursts, about which it appends a
// warning.
double UsualPeriod(const std::vector<int64_t>& utimes, double gap_factor, const std::string& csv,
                   std::vector<std::string>* warnings) {
  const auto median_us = static_cast<double>(Median(PeriodsOf(utimes)));
  const std::vector<int64_t> bursts = BeginsOfBursts(utimes, gap_factor * median_us);
  if (utimes.size() < kFewestStamps || static_cast<double>(bursts.size() - 1) <=
                                           kMaxShareOfGaps * static_cast<double>(utimes.size())) {
    return median_us;
  }
  const auto usual_us = static_cast<double>(Median(PeriodsOf(bursts)));
  warnings->push_back(fmt::format(
      "{}: {} of {} stamps follow the one before by {:.4g} ms, in bursts {:.4g} ms apart: copies, "
      "or a driver that sends several at once?",
      csv, utimes.size() - bursts.size(), utimes.size(), 1e-3 * median_us, 1e-3 * usual_us));
  return usual_us;
}

void NameGaps(const std::vector<int64_t>& utimes, double limit_us, const std::string& csv,
              std::vector<std::string>* warnings) {
  constexpr int kNamed = 5;
  int gaps = 0;
  for (size_t i = 1; i < utimes.size(); ++i) {
    const auto period_us = static_cast<double>(utimes[i] - utimes[i - 1]);
    if (period_us > limit_us && ++gaps <= kNamed) {
      warnings->push_back(fmt::format("{}: gap of {:.3f} s after {:.3f} s", csv, 1e-6 * period_us,
                                      1e-6 * static_cast<double>(utimes[i - 1] - utimes.front())));
    }
  }
  if (gaps > kNamed) {
    warnings->push_back(fmt::format("{}: ... and {} more gaps", csv, gaps - kNamed));
  }
}

}  // namespace

void NameStamps(const std::vector<int64_t>& utimes, double gap_factor, const std::string& csv,
                const std::optional<double>& stated_hz, const std::string& sensor_yaml,
                std::vector<std::string>* warnings) {
  if (utimes.size() < 3) {
    return;
  }
  const double usual_us = UsualPeriod(utimes, gap_factor, csv, warnings);
  NameGaps(utimes, gap_factor * usual_us, csv, warnings);
  const double measured_hz = 1e6 / usual_us;
  if (stated_hz && utimes.size() >= kFewestStamps &&
      std::abs(measured_hz - *stated_hz) > kSameRate * *stated_hz) {
    warnings->push_back(
        fmt::format("{}: states {:.4g} Hz, but by their stamps the rows of {} come at {:.4g} Hz, "
                    "which counts; are the stamps right?",
                    sensor_yaml, *stated_hz, csv, measured_hz));
  }
}

}  // namespace pangea
