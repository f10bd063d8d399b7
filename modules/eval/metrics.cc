#include "eval/metrics.h"

#include <algorithm>
#include <cmath>
#include <functional>

namespace pangea {
namespace {

Ate ErrorsUnder(const TrajectoryAlignment& alignment, const std::vector<PosePair>& pairs) {
  Ate ate;
  ate.alignment = alignment;
  std::vector<double> position_m;
  std::vector<double> rotation_rad;
  for (const PosePair& pair : pairs) {
    const Rigid3 aligned = alignment * pair.T_estimate_body;
    const PoseError error{pair.utime, (aligned.t - pair.T_reference_body.t).norm(),
                          LogSo3(pair.T_reference_body.q.conjugate() * aligned.q).norm()};
    ate.errors.push_back(error);
    position_m.push_back(error.position_m);
    rotation_rad.push_back(error.rotation_rad);
  }
  ate.position_m = StatisticsOf(std::move(position_m));
  ate.rotation_rad = StatisticsOf(std::move(rotation_rad));
  return ate;
}

// `progress` ascends with the pairs; each part goes from i to the first j with progress larger by
// `length`.
std::optional<Rpe> RelativeError(const std::vector<PosePair>& pairs,
                                 const std::vector<double>& progress, double length) {
  std::vector<double> position_m;
  std::vector<double> rotation_rad;
  for (size_t i = 0, j = 0; i < pairs.size(); ++i) {
    while (j < pairs.size() && progress[j] - progress[i] < length) {
      ++j;
    }
    if (j == pairs.size()) {
      break;
    }
    const Rigid3 estimate = pairs[i].T_estimate_body.Inverse() * pairs[j].T_estimate_body;
    const Rigid3 reference = pairs[i].T_reference_body.Inverse() * pairs[j].T_reference_body;
    const Rigid3 error = reference.Inverse() * estimate;
    position_m.push_back(error.t.norm());
    rotation_rad.push_back(LogSo3(error.q).norm());
  }
  if (position_m.empty()) {
    return std::nullopt;
  }
  return Rpe{StatisticsOf(std::move(position_m)), StatisticsOf(std::move(rotation_rad))};
}

}  // namespace

std::vector<PosePair> Associate(const Trajectory& estimate, const Trajectory& reference,
                                int64_t max_gap_us) {
  std::vector<PosePair> pairs;
  for (const auto& [utime, T] : estimate) {
    if (const auto T_reference = Interpolate(reference, utime, max_gap_us)) {
      pairs.push_back({utime, T, *T_reference});
    }
  }
  return pairs;
}

Statistics StatisticsOf(std::vector<double> values) {
  Statistics s;
  s.count = values.size();
  if (values.empty()) {
    return s;
  }
  double sum = 0;
  double sum_of_squares = 0;
  for (const double v : values) {
    sum += v;
    sum_of_squares += v * v;
  }
  const auto n = static_cast<double>(values.size());
  s.mean = sum / n;
  s.rmse = std::sqrt(sum_of_squares / n);
  std::ranges::sort(values);
  const size_t half = values.size() / 2;
  s.median = values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]);
  s.max = values.back();
  return s;
}

std::optional<Ate> AbsoluteError(const std::vector<PosePair>& pairs, TrajectoryAlignmentKind kind) {
  auto joint = JointAbsoluteError({pairs}, kind);
  return joint ? std::optional(std::move(joint->agents.front())) : std::nullopt;
}

std::optional<JointAte> JointAbsoluteError(const std::vector<std::vector<PosePair>>& agents,
                                           TrajectoryAlignmentKind kind) {
  std::vector<Eigen::Vector3d> estimate;
  std::vector<Eigen::Vector3d> reference;
  for (const std::vector<PosePair>& pairs : agents) {
    for (const PosePair& pair : pairs) {
      estimate.push_back(pair.T_estimate_body.t);
      reference.push_back(pair.T_reference_body.t);
    }
  }
  if (estimate.size() < kMinPairs) {
    return std::nullopt;
  }
  JointAte joint;
  joint.alignment = AlignTrajectories(estimate, reference, kind);
  std::vector<double> position_m;
  for (const std::vector<PosePair>& pairs : agents) {
    joint.agents.push_back(ErrorsUnder(joint.alignment, pairs));
    for (const PoseError& error : joint.agents.back().errors) {
      position_m.push_back(error.position_m);
    }
  }
  joint.position_m = StatisticsOf(std::move(position_m));
  return joint;
}

std::optional<Rpe> RelativeErrorOverDistance(const std::vector<PosePair>& pairs,
                                             double distance_m) {
  std::vector<double> path_m(pairs.size(), 0.0);
  for (size_t i = 1; i < pairs.size(); ++i) {
    path_m[i] =
        path_m[i - 1] + (pairs[i].T_reference_body.t - pairs[i - 1].T_reference_body.t).norm();
  }
  return RelativeError(pairs, path_m, distance_m);
}

std::optional<Rpe> RelativeErrorOverTime(const std::vector<PosePair>& pairs, double duration_s) {
  std::vector<double> time_s;
  time_s.reserve(pairs.size());
  for (const PosePair& pair : pairs) {
    time_s.push_back(1e-6 * static_cast<double>(pair.utime - pairs.front().utime));
  }
  return RelativeError(pairs, time_s, duration_s);
}

std::optional<double> Coverage(const Trajectory& estimate, const Trajectory& reference) {
  if (reference.empty()) {
    return std::nullopt;
  }
  const int64_t begin = reference.front().utime + kCoverageGraceUs;
  const int64_t end = reference.back().utime;
  if (end <= begin) {
    return std::nullopt;
  }
  int64_t covered = 0;
  int64_t until = begin;  // the time before it is accounted for
  for (size_t i = 0; i < estimate.size(); ++i) {
    const int64_t utime = estimate[i].utime;
    const bool joined = i > 0 && utime - estimate[i - 1].utime <= kMaxPoseStepUs;
    const int64_t from = joined ? estimate[i - 1].utime : utime - kCoverageReachUs;
    const int64_t to = std::min(end, utime + kCoverageReachUs);
    covered += std::max<int64_t>(0, to - std::max(from, until));
    until = std::max(until, to);
  }
  return static_cast<double>(covered) / static_cast<double>(end - begin);
}

}  // namespace pangea
