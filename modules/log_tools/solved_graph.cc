#include "log_tools/solved_graph.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <stdexcept>

#include "core/median.h"

namespace pangea {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;
// A fixed vertex that moved less was rounded, or held by a prior.
constexpr double kMoved_m = 1e-3, kMoved_rad = 1e-3;
constexpr double kSaidScaleChange = 0.01;
// Shorter edges are noise, without a scale.
constexpr double kMinEdge_m = 0.02;

// A group's vertices are consecutive: [begin, end).
struct Vertices {
  int64_t begin = 0, end = 0;
  bool Contains(int64_t vertex) const { return vertex >= begin && vertex < end; }
};

double Rotation_rad(const Rigid3& a, const Rigid3& b) {
  return LogSo3(a.q.conjugate() * b.q).norm();
}

// How many times longer the group's edges are between the solved poses than between the log's:
// the median. Empty without edges.
std::optional<double> ScaleOf(const Vertices& group, const Graph& log, const Graph& solved) {
  std::vector<double> ratios;
  for (const GraphEdge& edge : log.edges) {
    const double before_m = (log.vertices.at(edge.to).t - log.vertices.at(edge.from).t).norm();
    if (group.Contains(edge.from) && before_m > kMinEdge_m) {
      const Eigen::Vector3d after = solved.vertices.at(edge.to).t - solved.vertices.at(edge.from).t;
      ratios.push_back(after.norm() / before_m);
    }
  }
  return ratios.empty() ? std::nullopt : std::optional(Median(std::move(ratios)));
}

// Returns a remark on a change that is taken; empty for none.
std::string CheckScale(const Vertices& group, const Graph& log, const std::string& file,
                       const Graph& solved) {
  const double scale = ScaleOf(group, log, solved).value_or(1);
  if (std::abs(scale - 1) > kMaxScaleChange) {
    throw std::runtime_error(fmt::format(
        "{}: the positions of vertices {} to {} are {:.4g} times those of the log: its map is in "
        "metres, known by the IMU to {:.0f} %. Solve it with the edges' lengths as exported, or "
        "divide the positions by {:.4g}",
        file, group.begin, group.end - 1, scale, 100 * kMaxScaleChange, scale));
  }
  return std::abs(scale - 1) > kSaidScaleChange
             ? fmt::format(
                   "{}: the positions of vertices {} to {} are {:.3f} times those of the log", file,
                   group.begin, group.end - 1, scale)
             : std::string();
}

// The vertex that keeps its pose.
int64_t FixedVertex(const Vertices& group, const Graph& log, const Graph& solved) {
  for (const Graph* graph : {&solved, &log}) {
    for (const int64_t vertex : graph->fixed) {
      if (group.Contains(vertex)) {
        return vertex;
      }
    }
  }
  return group.begin;
}

// Returns a remark if the group was moved.
std::string MoveBack(const Vertices& group, const Graph& log, const std::string& file,
                     Graph* solved) {
  const int64_t fixed = FixedVertex(group, log, *solved);
  const Rigid3& before = log.vertices.at(fixed);
  const Rigid3& after = solved->vertices.at(fixed);
  const double moved_m = (after.t - before.t).norm(), moved_rad = Rotation_rad(before, after);
  if (moved_m <= kMoved_m && moved_rad <= kMoved_rad) {
    return "";
  }
  const Rigid3 T_map_file = before * after.Inverse();
  for (int64_t vertex = group.begin; vertex < group.end; ++vertex) {
    Rigid3& pose = solved->vertices.at(vertex);
    pose = T_map_file * pose;
    pose.q.normalize();
  }
  return fmt::format(
      "{}: the fixed vertex {} is {:.3f} m and {:.2f} deg from where the log has it; so vertices "
      "{} to {} were moved together, by a rigid transform that puts it back",
      file, fixed, moved_m, kDegrees * moved_rad, group.begin, group.end - 1);
}

// The angle between the directions of gravity, in the body, by the two poses.
double Tilt_deg(const Rigid3& before, const Rigid3& after) {
  const Eigen::Vector3d up_before = before.q.conjugate() * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d up_after = after.q.conjugate() * Eigen::Vector3d::UnitZ();
  return kDegrees * std::atan2(up_before.cross(up_after).norm(), up_before.dot(up_after));
}

void CheckTilt(const Vertices& group, const Graph& log, const std::string& file,
               const Graph& solved) {
  for (int64_t vertex = group.begin; vertex < group.end; ++vertex) {
    const double tilt_deg = Tilt_deg(log.vertices.at(vertex), solved.vertices.at(vertex));
    if (tilt_deg > kMaxTilt_deg) {
      throw std::runtime_error(fmt::format(
          "{}: vertex {} is rotated by {:.1f} deg in roll and pitch, relative to the fixed vertex; "
          "the odometry knows both by gravity, and at most {:g} deg are taken. Solve the graph "
          "with the edges as exported, with the vertices that have FIX held",
          file, vertex, tilt_deg, kMaxTilt_deg));
    }
  }
}

void CheckCost(const Graph& log, const std::string& file, const SolvedPoses& poses) {
  const double one_sigma = 6 * static_cast<double>(log.edges.size());
  if (poses.cost_after > kMaxCostFactor * std::max(poses.cost_before, one_sigma)) {
    throw std::runtime_error(fmt::format(
        "{}: its poses contradict the log's own {} edges, whose cost would rise from {:.3f} to "
        "{:.3f}. Is it a solution of this log's graph, with poses of the bodies in the map "
        "(T_map_body)?",
        file, log.edges.size(), poses.cost_before, poses.cost_after));
  }
}

}  // namespace

SolvedPoses PlaceInMapFrames(const Graph& log, const std::vector<FinalGroup>& groups,
                             const std::string& file, Graph* solved) {
  SolvedPoses poses;
  Vertices group;
  for (const FinalGroup& of_group : groups) {
    group = {group.end, group.end + std::ssize(of_group.keyframes)};
    poses.remarks.push_back(CheckScale(group, log, file, *solved));
    poses.remarks.push_back(MoveBack(group, log, file, solved));
    CheckTilt(group, log, file, *solved);
  }
  std::erase(poses.remarks, "");
  Graph placed = log;
  placed.vertices = solved->vertices;
  poses.cost_before = Cost(log);
  poses.cost_after = Cost(placed);
  CheckCost(log, file, poses);
  return poses;
}

}  // namespace pangea
