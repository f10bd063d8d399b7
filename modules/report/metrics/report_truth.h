#pragma once

// Checks accepted constraints against the recordings' ground truth: whether they are right, and
// whether their covariance is honest.
//
// The error is measured (-) true in the covariance's own tangent (docs/conventions.md), so error^T
// covariance^-1 error has the mean 6 if the covariance is honest.

#include <map>
#include <numbers>
#include <optional>
#include <vector>

#include "report/report_log.h"

namespace pangea {

// A constraint with a larger error in either is wrong: it connects two different places.
inline constexpr double kWrongTranslation_m = 0.5;
inline constexpr double kWrongRotation_rad = 5 * std::numbers::pi / 180;

struct ConstraintWithTruth {
  Constraint constraint;
  Rigid3 T_from_to;                // true, bodies
  Eigen::Quaterniond q_odom_from;  // gives gravity in from's body: the z axis of odom points up
};

// Squared error normalised by the covariance, per dimension: mean 1 for an honest one.
struct NormalisedError {
  double mean = 0;
  double median = 0;
  double share_above_99 = 0;  // share above the 99 % quantile of an honest covariance
};

struct ConstraintsTruth {
  size_t checked = 0;
  size_t wrong = 0;
  // Over all checked constraints, including wrong ones; meaningless if checked is 0.
  NormalisedError pose;  // 6 dimensions
  NormalisedError position;
  NormalisedError yaw;
  double translation_median_m = 0;
  double translation_p95_m = 0;

  std::optional<double> Precision() const;
};

// The accepted constraints whose keyframes both have ground truth, sorted by id. `ground_truth`: by
// map, all in one frame.
std::vector<ConstraintWithTruth> ConstraintsWithTruth(
    const CapturedSession& session, const std::map<MapId, const Trajectory*>& ground_truth);

ConstraintsTruth CheckConstraints(const std::vector<ConstraintWithTruth>& constraints);

}  // namespace pangea
