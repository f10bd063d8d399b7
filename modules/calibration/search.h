#pragma once

// Searches initial values: the best of the 24 axis-aligned rotations, of time offsets and of fields
// of view, by epipolar residuals.

#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <vector>

#include "calibration/frame_pairs.h"
#include "calibration/parameters.h"
#include "core/imu/imu.h"

namespace pangea::calibration {

constexpr double kMaxOffset_s = 0.15;  // search range, in both directions
// velocity_change of the pairs for the search (epipolar.h); small, since they are short.
constexpr double kSearchVelocityChange = 0.2;

// Returns, for each rotation and field of view, the best time offset with its cost per residual;
// the best first. `camera`: gives image size, lens model and read-out. `fields_of_view`: of the
// wider side, radians.
struct Hypothesis {
  Parameters parameters;
  double cost = 0;
};
std::vector<Hypothesis> Search(std::span<const FramePair> pairs, std::span<const ImuSample> imu,
                               int64_t origin_utime, const CameraModel& camera,
                               std::span<const Eigen::Quaterniond> rotations,
                               std::span<const double> fields_of_view);

// Sorts by cost, the best first.
void SortByCost(std::vector<Hypothesis>* hypotheses);

// Selects the pairs with most motion, and thins their points.
std::vector<FramePair> WithMostMotion(std::span<const FramePair> pairs);

}  // namespace pangea::calibration
