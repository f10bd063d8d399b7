#pragma once

// Reads trajectories from two text formats: TUM (tum.h) and EuRoC's ground-truth csv ("nanoseconds,
// p (3), q w x y z" and, in 17 columns, velocity and biases). Either may have positions alone:
// "stamp x y z". The readers sort by time, and drop duplicates, malformed rows, and rows without a
// pose (not finite, or a quaternion of zeros) with a warning.

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "recording/tum.h"

namespace pangea {

// Nanoseconds to microseconds, rounded down (also below zero).
int64_t UtimeFromNs(int64_t ns);

// Sorts by `utime` and keeps the first of equal time stamps. Returns the number of rows that were
// out of order, and of rows dropped.
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
// Adds a warning about the outcome, if there is a reason, for the file `path`.
void Warn(const SortOutcome& outcome, const std::string& path, std::vector<std::string>* warnings);

// The readers throw std::runtime_error when the file has nothing usable, or when more than a tenth
// of its rows are of another format. Repairs are added to `warnings`.
Trajectory ReadTum(const std::string& path, std::vector<std::string>* warnings);
Trajectory ReadEurocGroundTruth(const std::string& path, std::vector<std::string>* warnings);
// Reads either format; the first row decides: EuRoC's has commas.
Trajectory ReadTrajectory(const std::string& path, std::vector<std::string>* warnings);
// The same, also of positions alone: four columns. `has_rotations`: false for these; the rotations
// are the identity then.
struct PosesOrPositions {
  Trajectory trajectory;
  bool has_rotations = true;
};
PosesOrPositions ReadPosesOrPositions(const std::string& path, std::vector<std::string>* warnings);

void WriteTum(const std::string& path, const Trajectory& trajectory);

// Interpolates the position linearly and the rotation by slerp. Nothing outside the trajectory, or
// when the two poses around `utime` are more than max_gap_us apart.
std::optional<Rigid3> Interpolate(const Trajectory& trajectory, int64_t utime, int64_t max_gap_us);

// Sum of the distances between consecutive positions, metres.
double PathLength(const Trajectory& trajectory);

}  // namespace pangea
