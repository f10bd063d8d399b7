#include "recording/trajectory.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <stdexcept>

#include "files/csv.h"
#include "files/text_file.h"

namespace pangea {
namespace {

constexpr double kMaxPosition_m = 1e9;
constexpr double kMaxStamp_s = 4e12;  // so that differences of stamps fit 64 bits

// Why a row cannot be used.
struct Fault {
  bool is_other_format = false;  // else: its program had no pose here
  std::string why;
};

constexpr size_t kPoseColumns = 8;
constexpr size_t kPositionColumns = 4;  // without a quaternion

// A time stamp or pose that is not finite or beyond bounds: its program had failed there.
std::optional<Fault> NotFinite(const CsvRow& row) {
  for (size_t i = 0; i < std::min(row.fields.size(), kPoseColumns); ++i) {
    if (IsNotFinite(row.fields[i])) {
      return Fault{false,
                   fmt::format("column {} '{}' is not a finite number", i + 1, row.fields[i])};
    }
    double metres = 0;
    if (i >= 1 && i <= 3 && ParseNumber(row.fields[i], &metres) &&
        std::abs(metres) > kMaxPosition_m) {
      return Fault{false, fmt::format("column {} '{}' is not from {} to {} m", i + 1, row.fields[i],
                                      -kMaxPosition_m, kMaxPosition_m)};
    }
  }
  return std::nullopt;
}

// Parses three or seven numbers from fields[1] on; the format decides the quaternion's order.
std::optional<Fault> ParsePose(const CsvRow& row, bool quaternion_w_first, Rigid3* pose) {
  double v[7] = {};
  const size_t count = std::min(row.fields.size(), kPoseColumns) - 1;
  for (size_t i = 0; i < count; ++i) {
    if (!ParseNumber(row.fields[1 + i], &v[i])) {
      return Fault{true,
                   fmt::format("column {} '{}' is not a finite number", i + 2, row.fields[1 + i])};
    }
  }
  *pose = Rigid3();
  pose->t = {v[0], v[1], v[2]};
  if (count == 3) {
    return std::nullopt;
  }
  pose->q = quaternion_w_first ? Eigen::Quaterniond(v[3], v[4], v[5], v[6])
                               : Eigen::Quaterniond(v[6], v[3], v[4], v[5]);
  const double norm = pose->q.norm();
  if (std::abs(norm - 1.0) > 0.05) {
    return Fault{norm > 0, fmt::format("the quaternion has norm {:.3f}, not 1", norm)};
  }
  pose->q.normalize();
  return std::nullopt;
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

// Parses a row's time stamp and pose.
using RowParser = std::function<std::optional<Fault>(const CsvRow& row, StampedPose* pose)>;

Trajectory ReadRows(const std::string& path, const std::vector<CsvRow>& rows,
                    const std::string& expected, const RowParser& parse,
                    std::vector<std::string>* warnings) {
  Trajectory trajectory;
  RowComplaints other_format(path);
  RowComplaints no_pose(path);
  for (const CsvRow& row : rows) {
    StampedPose pose;
    std::optional<Fault> fault = NotFinite(row);
    fault = fault ? fault : parse(row, &pose);
    if (!fault) {
      trajectory.push_back(pose);
    } else {
      (fault->is_other_format ? other_format : no_pose).Add(row.line, fault->why);
    }
  }
  other_format.ThrowIfTooMany(rows.size(), expected);
  std::vector<std::string> dropped = no_pose.Lines();
  if (trajectory.empty()) {
    throw std::runtime_error(
        fmt::format("{}; expected rows: {}",
                    dropped.empty() ? path + ": holds no pose" : dropped.front(), expected));
  }
  for (const RowComplaints* complaints : {&other_format, &no_pose}) {
    for (const std::string& line : complaints->Lines()) {
      warnings->push_back(line + "; row dropped");
    }
  }
  if (no_pose.count() > 1) {
    warnings->push_back(
        fmt::format("{}: {} of {} rows have no pose; dropped", path, no_pose.count(), rows.size()));
  }
  Warn(SortByTime(&trajectory), path, warnings);
  return trajectory;
}

std::optional<Fault> WrongColumns(const CsvRow& row, bool positions, bool is_euroc) {
  const size_t columns = row.fields.size();
  if (positions ? columns == kPositionColumns
                : columns == kPoseColumns || (is_euroc && columns == 17)) {
    return std::nullopt;
  }
  return Fault{true, fmt::format("{} columns instead of {}", columns,
                                 positions  ? "4"
                                 : is_euroc ? "8 or 17"
                                            : "8")};
}

Trajectory ReadTumRows(const std::string& path, const std::vector<CsvRow>& rows, bool positions,
                       std::vector<std::string>* warnings) {
  const auto parse = [positions](const CsvRow& row, StampedPose* pose) -> std::optional<Fault> {
    double seconds = 0;
    if (auto fault = WrongColumns(row, positions, false)) {
      return fault;
    }
    if (!ParseNumber(row.fields[0], &seconds) || std::abs(seconds) > kMaxStamp_s) {
      return Fault{true, fmt::format("'{}' is no stamp in seconds", row.fields[0])};
    }
    pose->utime = std::llround(seconds * 1e6);
    return ParsePose(row, false, &pose->T);
  };
  return ReadRows(path, rows, positions ? "seconds x y z" : "seconds tx ty tz qx qy qz qw", parse,
                  warnings);
}

Trajectory ReadEurocRows(const std::string& path, const std::vector<CsvRow>& rows, bool positions,
                         std::vector<std::string>* warnings) {
  const auto parse = [positions](const CsvRow& row, StampedPose* pose) -> std::optional<Fault> {
    int64_t ns = 0;
    if (auto fault = WrongColumns(row, positions, true)) {
      return fault;
    }
    if (!ParseNumber(row.fields[0], &ns)) {
      return Fault{true, fmt::format("'{}' is no stamp in whole nanoseconds", row.fields[0])};
    }
    pose->utime = UtimeFromNs(ns);
    return ParsePose(row, true, &pose->T);
  };
  return ReadRows(path, rows,
                  positions ? "nanoseconds, x, y, z"
                            : "nanoseconds, x, y, z, qw, qx, qy, qz (and 9 more, or none)",
                  parse, warnings);
}

Trajectory ReadEither(const std::string& path, const std::vector<CsvRow>& rows, bool positions,
                      std::vector<std::string>* warnings) {
  return rows.empty() || !rows.front().has_commas ? ReadTumRows(path, rows, positions, warnings)
                                                  : ReadEurocRows(path, rows, positions, warnings);
}

}  // namespace

Trajectory ReadTum(const std::string& path, std::vector<std::string>* warnings) {
  return ReadTumRows(path, ReadCsv(path), false, warnings);
}

Trajectory ReadEurocGroundTruth(const std::string& path, std::vector<std::string>* warnings) {
  return ReadEurocRows(path, ReadCsv(path), false, warnings);
}

Trajectory ReadTrajectory(const std::string& path, std::vector<std::string>* warnings) {
  return ReadEither(path, ReadCsv(path), false, warnings);
}

PosesOrPositions ReadPosesOrPositions(const std::string& path, std::vector<std::string>* warnings) {
  const std::vector<CsvRow> rows = ReadCsv(path);
  const bool positions = !rows.empty() && rows.front().fields.size() == kPositionColumns;
  return {ReadEither(path, rows, positions, warnings), !positions};
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
