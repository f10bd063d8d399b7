#pragma once

// Where to begin: of the 24 rotations that take axes to axes, time offsets and fields of view, the
// ones whose epipolar residuals are smallest.

#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "calibration/frame_pairs.h"
#include "calibration/parameters.h"
#include "core/imu/imu.h"

namespace pangea::calibration {

constexpr double kMaxOffset_s = 0.15;  // searched to either side
// Of the pairs searched on (epipolar.h): so short they are.
constexpr double kSearchVelocityChange = 0.2;

// Rotations camera to body.
std::vector<Eigen::Quaterniond> AxisAlignedRotations();
Eigen::Quaterniond NearestAxisAligned(const Eigen::Quaterniond& q_body_cam);
// The body's axes along which the image's right, its down and the line of sight point, of the
// nearest of these rotations: "-y,-x,-z".
std::string AxesOf(const Eigen::Quaterniond& q_body_cam);

// Best time offset of each rotation and field of view with its cost per residual, the best first.
// `camera` has size, kind and read-out; fields of view are of its wider side, radians.
struct Hypothesis {
  Parameters parameters;
  double cost = 0;
};
std::vector<Hypothesis> Search(std::span<const FramePair> pairs, std::span<const ImuSample> imu,
                               int64_t origin_utime, const CameraModel& camera,
                               std::span<const Eigen::Quaterniond> rotations,
                               std::span<const double> fields_of_view);

// The best first.
void SortByCost(std::vector<Hypothesis>* hypotheses);

// The pairs with most motion, each thinned.
std::vector<FramePair> WithMostMotion(std::span<const FramePair> pairs);

}  // namespace pangea::calibration
