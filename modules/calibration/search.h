#pragma once

// Where to begin: of the 24 rotations that take axes to axes, time offsets and fields of view, the
// ones whose epipolar residuals are smallest.

#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <vector>

#include "calibration/frame_pairs.h"
#include "calibration/parameters.h"
#include "core/imu/imu.h"

namespace pangea::calibration {

struct SearchOptions {
  double max_offset_s = 0.15;
  double offset_step_s = 0.015;
  int max_pairs = 50;
  int max_points = 25;           // of each
  double velocity_change = 0.2;  // so short are the pairs
  double sigma_px = 3;           // what the grid leaves
};

// Rotations camera to body.
std::vector<Eigen::Quaterniond> AxisAlignedRotations();

// Best time offset of each rotation and field of view with its cost per residual, the best first.
// `camera` has size, kind and read-out; fields of view are of its wider side, radians.
struct Hypothesis {
  Parameters parameters;
  double cost = 0;
};
std::vector<Hypothesis> Search(std::span<const FramePair> pairs, std::span<const ImuSample> imu,
                               int64_t origin_utime, const CameraModel& camera,
                               std::span<const Eigen::Quaterniond> rotations,
                               std::span<const double> fields_of_view,
                               const SearchOptions& options);

// The pairs with most motion, each thinned.
std::vector<FramePair> WithMostMotion(std::span<const FramePair> pairs,
                                      const SearchOptions& options);

// Of the wider side, radians.
double FieldOfView(const CameraModel& camera);
// Focal length, pixels, of a field of view over the wider side.
double FocalOf(double field_of_view, const CameraModel& camera);

}  // namespace pangea::calibration
