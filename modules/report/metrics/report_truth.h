#pragma once

// Accepted constraints against the recordings' ground truth: are they right, and is their
// covariance honest?
//
// The error is measured (-) true in the covariance's own tangent (docs/conventions.md), so
// error^T covariance^-1 error has the mean 6 if the covariance says what the errors are.

#include <map>
#include <numbers>
#include <optional>
#include <vector>

#include "report/report_log.h"

namespace pangea::session {

// Beyond either a constraint is wrong: it closes a loop between places that are not one.
inline constexpr double kWrongTranslation_m = 0.5;
inline constexpr double kWrongRotation_rad = 5 * std::numbers::pi / 180;

struct ConstraintWithTruth {
  Constraint constraint;
  Rigid3 T_from_to;                // true, bodies
  Eigen::Quaterniond q_odom_from;  // gravity in from's body: its odom axes have z up
};

// Squared error normalised by the covariance, per dimension: mean 1 for an honest one.
struct NormalisedError {
  double mean = 0;
  double median = 0;
  double share_above_99 = 0;  // beyond what 99 % of honest ones stay below
};

struct ConstraintsTruth {
  size_t checked = 0;
  size_t wrong = 0;
  // Over all checked, wrong ones too; without meaning when there are none.
  NormalisedError pose;  // 6 dimensions
  NormalisedError position;
  NormalisedError yaw;
  double translation_median_m = 0;
  double translation_p95_m = 0;

  std::optional<double> Precision() const;
};

// The accepted constraints of which both keyframes have ground truth, by id. `ground_truth` is by
// agent, all of it in one frame.
std::vector<ConstraintWithTruth> ConstraintsWithTruth(
    const CapturedSession& session, const std::map<int32_t, Trajectory>& ground_truth);

ConstraintsTruth CheckConstraints(const std::vector<ConstraintWithTruth>& constraints);

}  // namespace pangea::session
