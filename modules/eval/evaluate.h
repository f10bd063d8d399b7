#pragma once

// The results of pangea-eval, as text, JSON and plots, from pairs of trajectories.

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "eval/metrics.h"
#include "eval/plot.h"
#include "recording/trajectory.h"

namespace pangea {

// One agent: estimate and ground truth.
struct EvaluationInput {
  std::string name;
  Trajectory estimate;
  Trajectory reference;
  bool has_rotations = true;  // false: one of the two has positions alone
};

// A hint if the two are probably swapped: ground truth usually has more poses a second than an
// estimate, and this reference has less than half as many as its estimate. Else empty.
std::vector<std::string> SwappedWarnings(const EvaluationInput& input);

// Fewer associated poses are taken as a mistake (such as a different clock); their error would be
// meaningless.
inline constexpr size_t kMinAssociated = 10;
inline constexpr double kMinAssociatedShare = 0.05;

// Absolute error under one alignment for all inputs, by SE(3), yaw and Sim(3).
struct AbsoluteEvaluation {
  std::vector<std::string> names;
  std::vector<size_t> poses;        // of each estimate; by_alignment has the associated ones
  std::vector<bool> has_rotations;  // without, its rotation error means nothing, and is not written
  std::vector<std::optional<double>> coverage;
  std::vector<std::pair<TrajectoryAlignmentKind, JointAte>> by_alignment;
};
// Throws std::runtime_error if too few poses have ground truth (fewer than kMinAssociated poses, or
// than kMinAssociatedShare of an input), or if an error is not a number.
AbsoluteEvaluation EvaluateAbsolute(const std::vector<EvaluationInput>& inputs, double max_gap_s);
std::string ToText(const AbsoluteEvaluation& evaluation);
nlohmann::ordered_json ToJson(const AbsoluteEvaluation& evaluation);

struct RelativeRow {
  double length = 0;  // metres or seconds
  std::optional<Rpe> rpe;
};
struct RelativeEvaluation {
  std::string name;
  size_t poses = 0;
  size_t associated = 0;
  std::vector<RelativeRow> over_distance_m;
  std::vector<RelativeRow> over_time_s;
};
// Throws std::runtime_error if too few poses have ground truth, no part is long enough, an error is
// not a number, or there are no rotations: a relative error is between poses.
RelativeEvaluation EvaluateRelative(const EvaluationInput& input,
                                    const std::vector<double>& distances_m,
                                    const std::vector<double>& durations_s, double max_gap_s);
std::string ToText(const RelativeEvaluation& evaluation);
nlohmann::ordered_json ToJson(const RelativeEvaluation& evaluation);

// Top view (x, y of the reference frame), ground truth in grey, each input under `alignment`.
Plot TrajectoryPlot(const std::string& title, const std::vector<EvaluationInput>& inputs,
                    const TrajectoryAlignment& alignment);
// Position error over each input's own time since its reference's beginning.
Plot ErrorPlot(const std::string& title, const std::vector<EvaluationInput>& inputs,
               const JointAte& joint);

// The line of a trajectory in top view; it breaks between poses more than kMaxPoseStepUs apart.
std::vector<Eigen::Vector2d> TopView(const Trajectory& trajectory,
                                     const TrajectoryAlignment& alignment);
std::vector<Eigen::Vector2d> ErrorOverTime(const std::vector<PoseError>& errors, int64_t begin);

}  // namespace pangea
