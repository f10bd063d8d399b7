#include "eval/evaluate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <stdexcept>

#include "eval/table.h"

namespace pangea {
namespace {

using nlohmann::ordered_json;

constexpr double kDegrees = 180.0 / std::numbers::pi;

ordered_json ToJson(const Statistics& s, double factor) {
  return {{"count", s.count},
          {"rmse", factor * s.rmse},
          {"mean", factor * s.mean},
          {"median", factor * s.median},
          {"max", factor * s.max}};
}

std::vector<std::string> Cells(const std::string& alignment, const std::string& name,
                               const Ate& ate, bool has_rotations, const std::string& coverage) {
  const Statistics& p = ate.position_m;
  return {alignment,
          name,
          fmt::format("{}", p.count),
          fmt::format("{:.4f}", p.rmse),
          fmt::format("{:.4f}", p.mean),
          fmt::format("{:.4f}", p.median),
          fmt::format("{:.4f}", p.max),
          has_rotations ? fmt::format("{:.3f}", kDegrees * ate.rotation_rad.rmse) : "-",
          fmt::format("{:.4f}", ate.alignment.scale),
          coverage};
}

std::string Associated(const std::string& name, size_t associated, size_t poses) {
  return fmt::format("{}: {} of {} poses associated", name, associated, poses);
}

[[noreturn]] void ThrowTooFew(const EvaluationInput& input, size_t associated) {
  const auto span = [](const Trajectory& trajectory) {
    return trajectory.empty() ? "nothing"
                              : fmt::format("{:.3f} .. {:.3f} s", 1e-6 * trajectory.front().utime,
                                            1e-6 * trajectory.back().utime);
  };
  throw std::runtime_error(fmt::format(
      "{}; at least {} and {:.0f} % must have ground truth at their time. Poses: {}, ground truth: "
      "{}. Give the ground truth of the same recording in the same clock, in seconds; where it has "
      "fewer than ten poses a second, a larger --max-gap",
      Associated(input.name, associated, input.estimate.size()), kMinAssociated,
      100 * kMinAssociatedShare, span(input.estimate), span(input.reference)));
}

// Poses a second; 0 if that is unknown.
double RateOf(const Trajectory& trajectory) {
  const int64_t span_us =
      trajectory.empty() ? 0 : trajectory.back().utime - trajectory.front().utime;
  return span_us > 0
             ? 1e6 * static_cast<double>(trajectory.size() - 1) / static_cast<double>(span_us)
             : 0;
}

// Throws std::runtime_error if too few poses have ground truth.
std::vector<PosePair> PairsOf(const EvaluationInput& input, double max_gap_s) {
  std::vector<PosePair> pairs =
      Associate(input.estimate, input.reference, std::llround(1e6 * max_gap_s));
  if (pairs.size() < kMinAssociated ||
      static_cast<double>(pairs.size()) <
          kMinAssociatedShare * static_cast<double>(input.estimate.size())) {
    ThrowTooFew(input, pairs.size());
  }
  return pairs;
}

void CheckFinite(const Statistics& s, const std::string& of) {
  for (const double value : {s.rmse, s.mean, s.median, s.max}) {
    if (!std::isfinite(value)) {
      throw std::runtime_error(fmt::format("{}: its error cannot be told: it is no number", of));
    }
  }
}

void CheckFinite(const std::vector<RelativeRow>& rows, const std::string& of) {
  for (const auto& [length, rpe] : rows) {
    if (rpe) {
      CheckFinite(rpe->position_m, of);
      CheckFinite(rpe->rotation_rad, of);
    }
  }
}

void AddRows(const std::vector<RelativeRow>& rows, const std::string& unit, Table* table) {
  for (const auto& [length, rpe] : rows) {
    if (!rpe) {
      table->Add({fmt::format("{} {}", length, unit), "0", "-", "-", "-", "-", "-"});
      continue;
    }
    const std::string share = unit == "m"
                                  ? fmt::format("{:.2f} %", 100 * rpe->position_m.mean / length)
                                  : std::string("-");
    table->Add({fmt::format("{} {}", length, unit), fmt::format("{}", rpe->position_m.count),
                fmt::format("{:.4f}", rpe->position_m.rmse),
                fmt::format("{:.4f}", rpe->position_m.median),
                fmt::format("{:.4f}", rpe->position_m.max), share,
                fmt::format("{:.3f}", kDegrees * rpe->rotation_rad.rmse)});
  }
}

ordered_json RowsJson(const std::vector<RelativeRow>& rows, const std::string& length_key) {
  ordered_json list = ordered_json::array();
  for (const auto& [length, rpe] : rows) {
    ordered_json row = {{length_key, length}};
    row["position_m"] = rpe ? ToJson(rpe->position_m, 1) : ordered_json();
    row["rotation_deg"] = rpe ? ToJson(rpe->rotation_rad, kDegrees) : ordered_json();
    list.push_back(std::move(row));
  }
  return list;
}

}  // namespace

std::vector<std::string> SwappedWarnings(const EvaluationInput& input) {
  const double estimate = RateOf(input.estimate), reference = RateOf(input.reference);
  if (!(reference > 0) || 2 * reference > estimate) {
    return {};
  }
  return {fmt::format(
      "{}: it has {:.1f} poses a second, its reference only {:.1f}: are the two swapped? The "
      "order is ESTIMATE, then REFERENCE (the ground truth)",
      input.name, estimate, reference)};
}

AbsoluteEvaluation EvaluateAbsolute(const std::vector<EvaluationInput>& inputs, double max_gap_s) {
  AbsoluteEvaluation evaluation;
  std::vector<std::vector<PosePair>> pairs;
  for (const EvaluationInput& input : inputs) {
    evaluation.names.push_back(input.name);
    evaluation.poses.push_back(input.estimate.size());
    evaluation.has_rotations.push_back(input.has_rotations);
    evaluation.coverage.push_back(Coverage(input.estimate, input.reference));
    pairs.push_back(PairsOf(input, max_gap_s));
  }
  for (const TrajectoryAlignmentKind kind :
       {TrajectoryAlignmentKind::kSe3, TrajectoryAlignmentKind::kYaw,
        TrajectoryAlignmentKind::kSim3}) {
    auto joint = JointAbsoluteError(pairs, kind);
    if (!joint) {
      throw std::runtime_error(
          fmt::format("fewer than {} poses have a reference: no error can be told", kMinPairs));
    }
    for (size_t i = 0; i < inputs.size(); ++i) {
      CheckFinite(joint->agents[i].position_m, inputs[i].name);
      CheckFinite(joint->agents[i].rotation_rad, inputs[i].name);
    }
    evaluation.by_alignment.emplace_back(kind, std::move(*joint));
  }
  return evaluation;
}

std::string ToText(const AbsoluteEvaluation& evaluation) {
  Table table({"alignment", "trajectory", "poses", "ATE rmse m", "mean m", "median m", "max m",
               "rotation rmse deg", "scale", "coverage"});
  for (const auto& [kind, joint] : evaluation.by_alignment) {
    for (size_t i = 0; i < joint.agents.size(); ++i) {
      const auto& coverage = evaluation.coverage[i];
      table.Add(Cells(ToString(kind), evaluation.names[i], joint.agents[i],
                      evaluation.has_rotations[i],
                      coverage ? fmt::format("{:.3f}", *coverage) : "-"));
    }
    if (joint.agents.size() > 1) {
      const Statistics& p = joint.position_m;
      table.Add({ToString(kind), "all together", fmt::format("{}", p.count),
                 fmt::format("{:.4f}", p.rmse), fmt::format("{:.4f}", p.mean),
                 fmt::format("{:.4f}", p.median), fmt::format("{:.4f}", p.max), "-",
                 fmt::format("{:.4f}", joint.alignment.scale), "-"});
    }
  }
  std::string text;
  for (size_t i = 0; i < evaluation.names.size(); ++i) {
    const size_t associated = evaluation.by_alignment.front().second.agents[i].position_m.count;
    text += Associated(evaluation.names[i], associated, evaluation.poses[i]) + "\n";
    if (!evaluation.has_rotations[i]) {
      text += fmt::format("{}: positions alone, so no rotation error\n", evaluation.names[i]);
    }
  }
  return text + table.Text();
}

ordered_json ToJson(const AbsoluteEvaluation& evaluation) {
  ordered_json json;
  for (const auto& [kind, joint] : evaluation.by_alignment) {
    const TrajectoryAlignment& a = joint.alignment;
    const Rigid3& T = a.T_reference_estimate;
    ordered_json& entry = json[ToString(kind)];
    entry["scale"] = a.scale;
    entry["rotation_wxyz"] = {T.q.w(), T.q.x(), T.q.y(), T.q.z()};
    entry["translation_m"] = {T.t.x(), T.t.y(), T.t.z()};
    entry["ate_m"] = ToJson(joint.position_m, 1);
    for (size_t i = 0; i < joint.agents.size(); ++i) {
      const auto& coverage = evaluation.coverage[i];
      entry["trajectories"].push_back(
          {{"name", evaluation.names[i]},
           {"poses", evaluation.poses[i]},
           {"associated", joint.agents[i].position_m.count},
           {"ate_m", ToJson(joint.agents[i].position_m, 1)},
           {"rotation_deg", evaluation.has_rotations[i]
                                ? ToJson(joint.agents[i].rotation_rad, kDegrees)
                                : ordered_json()},
           {"coverage", coverage ? ordered_json(*coverage) : ordered_json()}});
    }
  }
  return json;
}

RelativeEvaluation EvaluateRelative(const EvaluationInput& input,
                                    const std::vector<double>& distances_m,
                                    const std::vector<double>& durations_s, double max_gap_s) {
  if (!input.has_rotations) {
    throw std::runtime_error(
        fmt::format("{}: it or its reference has positions alone, and a relative error is between "
                    "poses: give eight columns, or use ate",
                    input.name));
  }
  const std::vector<PosePair> pairs = PairsOf(input, max_gap_s);
  RelativeEvaluation evaluation{input.name, input.estimate.size(), pairs.size(), {}, {}};
  for (const double distance_m : distances_m) {
    evaluation.over_distance_m.push_back(
        {distance_m, RelativeErrorOverDistance(pairs, distance_m)});
  }
  for (const double duration_s : durations_s) {
    evaluation.over_time_s.push_back({duration_s, RelativeErrorOverTime(pairs, duration_s)});
  }
  CheckFinite(evaluation.over_distance_m, input.name);
  CheckFinite(evaluation.over_time_s, input.name);
  const auto is_there = [](const RelativeRow& row) { return row.rpe.has_value(); };
  if (std::ranges::none_of(evaluation.over_distance_m, is_there) &&
      std::ranges::none_of(evaluation.over_time_s, is_there)) {
    throw std::runtime_error(
        fmt::format("{}: it has no stretch as long as any of those asked for: no error can be told",
                    input.name));
  }
  return evaluation;
}

std::string ToText(const RelativeEvaluation& evaluation) {
  Table table(
      {"over", "stretches", "RPE rmse m", "median m", "max m", "mean share", "rotation rmse deg"});
  AddRows(evaluation.over_distance_m, "m", &table);
  AddRows(evaluation.over_time_s, "s", &table);
  return Associated(evaluation.name, evaluation.associated, evaluation.poses) + "\n" + table.Text();
}

ordered_json ToJson(const RelativeEvaluation& evaluation) {
  return {{"poses", evaluation.poses},
          {"associated", evaluation.associated},
          {"over_distance", RowsJson(evaluation.over_distance_m, "distance_m")},
          {"over_time", RowsJson(evaluation.over_time_s, "duration_s")}};
}

std::vector<Eigen::Vector2d> TopView(const Trajectory& trajectory,
                                     const TrajectoryAlignment& alignment) {
  std::vector<Eigen::Vector2d> points;
  for (size_t i = 0; i < trajectory.size(); ++i) {
    if (i > 0 && trajectory[i].utime - trajectory[i - 1].utime > kMaxPoseStepUs) {
      points.push_back(kPlotBreak);
    }
    points.emplace_back((alignment * trajectory[i].T.t).head<2>());
  }
  return points;
}

std::vector<Eigen::Vector2d> ErrorOverTime(const std::vector<PoseError>& errors, int64_t begin) {
  std::vector<Eigen::Vector2d> points;
  for (size_t i = 0; i < errors.size(); ++i) {
    if (i > 0 && errors[i].utime - errors[i - 1].utime > kMaxPoseStepUs) {
      points.push_back(kPlotBreak);
    }
    points.emplace_back(1e-6 * static_cast<double>(errors[i].utime - begin), errors[i].position_m);
  }
  return points;
}

Plot TrajectoryPlot(const std::string& title, const std::vector<EvaluationInput>& inputs,
                    const TrajectoryAlignment& alignment) {
  Plot plot{.title = title, .x_label = "x [m]", .y_label = "y [m]", .equal_axes = true};
  for (const EvaluationInput& input : inputs) {
    plot.lines.push_back({.label = plot.lines.empty() ? "ground truth" : "",
                          .colour = kGroundTruthColour,
                          .width = 5,
                          .points = TopView(input.reference, TrajectoryAlignment())});
  }
  for (size_t i = 0; i < inputs.size(); ++i) {
    plot.lines.push_back({.label = inputs[i].name,
                          .colour = AgentColour(i),
                          .points = TopView(inputs[i].estimate, alignment),
                          .mark_start = true});
  }
  return plot;
}

Plot ErrorPlot(const std::string& title, const std::vector<EvaluationInput>& inputs,
               const JointAte& joint) {
  Plot plot{.title = title,
            .x_label = "time since the ground truth's beginning [s]",
            .y_label = "position error [m]",
            .y_from_zero = true};
  for (size_t i = 0; i < inputs.size(); ++i) {
    plot.lines.push_back(
        {.label =
             fmt::format("{} (rmse {:.3f} m)", inputs[i].name, joint.agents[i].position_m.rmse),
         .colour = AgentColour(i),
         .points = ErrorOverTime(joint.agents[i].errors, inputs[i].reference.front().utime)});
  }
  return plot;
}

}  // namespace pangea
