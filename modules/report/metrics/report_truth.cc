#include "report/metrics/report_truth.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "eval/metrics.h"

namespace pangea {
namespace {

// 99 % quantiles of chi-square with 6, 3 and 1 degrees of freedom.
constexpr double kBoundPose = 16.812, kBoundPosition = 11.345, kBoundYaw = 6.635;

std::optional<Rigid3> TruePose(const CapturedKeyframe& keyframe, const MapId& map,
                               const std::map<MapId, const Trajectory*>& ground_truth) {
  const auto truth = ground_truth.find(map);
  return truth == ground_truth.end()
             ? std::nullopt
             : Interpolate(*truth->second, keyframe.utime, kMaxGroundTruthGapUs);
}

NormalisedError Normalised(const std::vector<double>& squared, int dimensions, double bound) {
  NormalisedError error;
  if (!squared.empty()) {
    const Statistics statistics = StatisticsOf(squared);
    const auto above = std::ranges::count_if(squared, [&](double s) { return s > bound; });
    error.mean = statistics.mean / dimensions;
    error.median = statistics.median / dimensions;
    error.share_above_99 = static_cast<double>(above) / static_cast<double>(squared.size());
  }
  return error;
}

// The 95 % percentile: the smallest value that 95 % of all do not exceed.
double Percentile95(std::vector<double> values) {
  if (values.empty()) {
    return 0;
  }
  std::ranges::sort(values);
  const double rank = std::ceil(0.95 * static_cast<double>(values.size()));
  return values[static_cast<size_t>(rank) - 1];
}

}  // namespace

std::optional<double> ConstraintsTruth::Precision() const {
  return checked == 0
             ? std::nullopt
             : std::optional(1 - static_cast<double>(wrong) / static_cast<double>(checked));
}

std::vector<ConstraintWithTruth> ConstraintsWithTruth(
    const CapturedSession& session, const std::map<MapId, const Trajectory*>& ground_truth) {
  std::vector<ConstraintWithTruth> known;
  for (const auto& [id, constraint] : session.constraints) {
    const auto from = session.keyframes.find(constraint.from);
    const auto to = session.keyframes.find(constraint.to);
    if (!constraint.accepted || from == session.keyframes.end() || to == session.keyframes.end()) {
      continue;
    }
    const auto T_from = TruePose(from->second, constraint.from.map, ground_truth);
    const auto T_to = TruePose(to->second, constraint.to.map, ground_truth);
    if (T_from && T_to) {
      known.push_back({constraint, T_from->Inverse() * *T_to, from->second.T_odom_body.q});
    }
  }
  return known;
}

ConstraintsTruth CheckConstraints(const std::vector<ConstraintWithTruth>& constraints) {
  ConstraintsTruth result;
  std::vector<double> pose;
  std::vector<double> position;
  std::vector<double> yaw;
  std::vector<double> translation_m;
  for (const auto& [constraint, T_true, q_odom_from] : constraints) {
    const Vector6d error = constraint.T_from_to.Minus(T_true);
    const Matrix6d& covariance = constraint.covariance;
    const Eigen::Vector3d dp = error.head<3>();
    const Eigen::Matrix3d position_covariance = covariance.topLeftCorner<3, 3>();
    pose.push_back(error.dot(covariance.ldlt().solve(error)));
    position.push_back(dp.dot(position_covariance.ldlt().solve(dp)));
    // Rotate into axes with z up, in which dtheta.z is yaw.
    const Eigen::Vector3d up = q_odom_from.conjugate() * Eigen::Vector3d::UnitZ();
    const double dyaw = up.dot(error.tail<3>());
    yaw.push_back(dyaw * dyaw / up.dot(covariance.bottomRightCorner<3, 3>() * up));
    translation_m.push_back(dp.norm());
    result.wrong +=
        dp.norm() > kWrongTranslation_m || error.tail<3>().norm() > kWrongRotation_rad ? 1 : 0;
  }
  result.checked = constraints.size();
  result.pose = Normalised(pose, 6, kBoundPose);
  result.position = Normalised(position, 3, kBoundPosition);
  result.yaw = Normalised(yaw, 1, kBoundYaw);
  result.translation_median_m = StatisticsOf(translation_m).median;
  result.translation_p95_m = Percentile95(std::move(translation_m));
  return result;
}

}  // namespace pangea
