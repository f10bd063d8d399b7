#include "recording/trajectory.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>

#include "files/csv.h"
#include "files/text_file.h"

namespace pangea {
namespace {

constexpr double kMaxPosition_m = 1e9;
constexpr double kMaxStamp_s = 4e12;  // so that differences of stamps fit 64 bits

[[noreturn]] void Refuse(const std::string& path, const CsvRow& row, size_t column,
                         const std::string& why) {
  throw std::runtime_error(fmt::format("{}:{}: column {} '{}' is {}", path, row.line, column + 1,
                                       row.fields[column], why));
}

// Throws unless the row's time stamp and pose are finite and within bounds.
void CheckFinite(const std::string& path, const CsvRow& row) {
  constexpr size_t kColumns = 8;
  for (size_t i = 0; i < std::min(row.fields.size(), kColumns); ++i) {
    if (IsNotFinite(row.fields[i])) {
      Refuse(path, row, i, "not a finite number");
    }
    double metres = 0;
    if (i >= 1 && i <= 3 && ParseNumber(row.fields[i], &metres) &&
        std::abs(metres) > kMaxPosition_m) {
      Refuse(path, row, i, fmt::format("not from {} to {} m", -kMaxPosition_m, kMaxPosition_m));
    }
  }
}

// Parses seven numbers from fields[1] on; the format decides the quaternion's order. False, with a
// reason, if they are malformed.
bool ParsePose(const CsvRow& row, bool quaternion_w_first, Rigid3* pose, std::string* why) {
  double v[7];
  for (int i = 0; i < 7; ++i) {
    if (!ParseNumber(row.fields[1 + i], &v[i])) {
      *why = fmt::format("column {} '{}' is not a finite number", i + 2, row.fields[1 + i]);
      return false;
    }
  }
  pose->t = {v[0], v[1], v[2]};
  pose->q = quaternion_w_first ? Eigen::Quaterniond(v[3], v[4], v[5], v[6])
                               : Eigen::Quaterniond(v[6], v[3], v[4], v[5]);
  if (std::abs(pose->q.norm() - 1.0) > 0.05) {
    *why = fmt::format("the quaternion has norm {:.3f}, not 1", pose->q.norm());
    return false;
  }
  pose->q.normalize();
  return true;
}

}  // namespace

int64_t UtimeFromNs(int64_t ns) { return ns / 1000 - (ns % 1000 < 0 ? 1 : 0); }

void Warn(const SortOutcome& outcome, const std::string& path, std::vector<std::string>* warnings) {
  if (outcome.out_of_order > 0) {
    warnings->push_back(
        fmt::format("{}: {} rows out of order; sorted", path, outcome.out_of_order));
  }
  if (outcome.duplicates > 0) {
    warnings->push_back(
        fmt::format("{}: {} rows with a stamp already seen; dropped", path, outcome.duplicates));
  }
}

namespace {

// Parses a row's time stamp and pose. False, with a reason, when it is malformed.
using RowParser = std::function<bool(const CsvRow& row, StampedPose* pose, std::string* why)>;

Trajectory ReadRows(const std::string& path, const std::string& expected, const RowParser& parse,
                    std::vector<std::string>* warnings) {
  const std::vector<CsvRow> rows = ReadCsv(path);
  Trajectory trajectory;
  RowComplaints complaints(path);
  for (const CsvRow& row : rows) {
    StampedPose pose;
    std::string why;
    CheckFinite(path, row);
    if (parse(row, &pose, &why)) {
      trajectory.push_back(pose);
    } else {
      complaints.Add(row.line, why);
    }
  }
  complaints.ThrowIfTooMany(rows.size(), expected);
  if (trajectory.empty()) {
    throw std::runtime_error(fmt::format("{}: holds no pose; expected rows: {}", path, expected));
  }
  for (const std::string& line : complaints.Lines()) {
    warnings->push_back(line + "; row dropped");
  }
  Warn(SortByTime(&trajectory), path, warnings);
  return trajectory;
}

bool ParseTumRow(const CsvRow& row, StampedPose* pose, std::string* why) {
  double seconds = 0;
  if (row.fields.size() != 8) {
    *why = fmt::format("{} columns instead of 8", row.fields.size());
    return false;
  }
  if (!ParseNumber(row.fields[0], &seconds) || std::abs(seconds) > kMaxStamp_s) {
    *why = fmt::format("'{}' is no stamp in seconds", row.fields[0]);
    return false;
  }
  pose->utime = std::llround(seconds * 1e6);
  return ParsePose(row, false, &pose->T, why);
}

bool ParseEurocRow(const CsvRow& row, StampedPose* pose, std::string* why) {
  int64_t ns = 0;
  if (row.fields.size() != 8 && row.fields.size() != 17) {
    *why = fmt::format("{} columns instead of 8 or 17", row.fields.size());
    return false;
  }
  if (!ParseNumber(row.fields[0], &ns)) {
    *why = fmt::format("'{}' is no stamp in whole nanoseconds", row.fields[0]);
    return false;
  }
  pose->utime = UtimeFromNs(ns);
  return ParsePose(row, true, &pose->T, why);
}

}  // namespace

Trajectory ReadTum(const std::string& path, std::vector<std::string>* warnings) {
  return ReadRows(path, "seconds tx ty tz qx qy qz qw", ParseTumRow, warnings);
}

Trajectory ReadEurocGroundTruth(const std::string& path, std::vector<std::string>* warnings) {
  return ReadRows(path, "nanoseconds, x, y, z, qw, qx, qy, qz (and 9 more, or none)", ParseEurocRow,
                  warnings);
}

Trajectory ReadTrajectory(const std::string& path, std::vector<std::string>* warnings) {
  const std::vector<CsvRow> rows = ReadCsv(path);
  return rows.empty() || !rows.front().has_commas ? ReadTum(path, warnings)
                                                  : ReadEurocGroundTruth(path, warnings);
}

void WriteTum(const std::string& path, const Trajectory& trajectory) {
  WriteTextFile(path, ToTum(trajectory));
}

std::optional<Rigid3> Interpolate(const Trajectory& trajectory, int64_t utime, int64_t max_gap_us) {
  const auto after = std::ranges::lower_bound(trajectory, utime, {}, &StampedPose::utime);
  if (after == trajectory.end()) {
    return std::nullopt;
  }
  if (after->utime == utime) {
    return after->T;
  }
  if (after == trajectory.begin()) {
    return std::nullopt;
  }
  const StampedPose& a = *std::prev(after);
  const StampedPose& b = *after;
  if (b.utime - a.utime > max_gap_us) {
    return std::nullopt;
  }
  const double s = static_cast<double>(utime - a.utime) / static_cast<double>(b.utime - a.utime);
  return Rigid3(a.T.q.slerp(s, b.T.q), (1.0 - s) * a.T.t + s * b.T.t);
}

double PathLength(const Trajectory& trajectory) {
  double length = 0;
  for (size_t i = 1; i < trajectory.size(); ++i) {
    length += (trajectory[i].T.t - trajectory[i - 1].T.t).norm();
  }
  return length;
}

}  // namespace pangea
