#pragma once

// Trajectories read from the two text formats they live in: TUM (tum.h) and EuRoC's ground-truth
// csv ("nanoseconds, p (3), q w x y z" and, in 17 columns, velocity and biases). Readers sort by
// time, drop duplicates and malformed rows, and say so.

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "recording/tum.h"

namespace pangea {

// Nanoseconds to microseconds, rounded down (also below zero).
int64_t UtimeFromNs(int64_t ns);

// Sorts by `utime` and keeps the first of equal stamps; returns how many rows were out of order and
// how many dropped.
struct SortOutcome {
  int out_of_order = 0;
  int duplicates = 0;
};
template <typename Stamped>
SortOutcome SortByTime(std::vector<Stamped>* rows) {
  SortOutcome outcome;
  for (size_t i = 1; i < rows->size(); ++i) {
    outcome.out_of_order += (*rows)[i].utime < (*rows)[i - 1].utime ? 1 : 0;
  }
  std::ranges::stable_sort(*rows, {}, &Stamped::utime);
  const auto repeated =
      std::unique(rows->begin(), rows->end(),
                  [](const Stamped& a, const Stamped& b) { return a.utime == b.utime; });
  outcome.duplicates = static_cast<int>(rows->end() - repeated);
  rows->erase(repeated, rows->end());
  return outcome;
}
// The same for the rows of a file; what it mended is added to `warnings`.
void Warn(const SortOutcome& outcome, const std::string& path, std::vector<std::string>* warnings);

// The readers throw std::runtime_error when nothing usable is in the file, and, by line, at a stamp
// or pose that is not finite or further away than 1e9 m: what wrote it had failed, and an error
// without that row would hide it. What they mended is added to `warnings`.
Trajectory ReadTum(const std::string& path, std::vector<std::string>* warnings);
Trajectory ReadEurocGroundTruth(const std::string& path, std::vector<std::string>* warnings);
// Either format, told apart by the first row: EuRoC's has commas.
Trajectory ReadTrajectory(const std::string& path, std::vector<std::string>* warnings);

void WriteTum(const std::string& path, const Trajectory& trajectory);

// Position linear, rotation slerp; nothing outside the trajectory, or when the two poses around
// `utime` are further apart than max_gap_us.
std::optional<Rigid3> Interpolate(const Trajectory& trajectory, int64_t utime, int64_t max_gap_us);

// Sum of the distances between consecutive positions, metres.
double PathLength(const Trajectory& trajectory);

}  // namespace pangea
