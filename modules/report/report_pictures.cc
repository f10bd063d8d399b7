#include "report/report_pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>

#include "core/keyframe.h"
#include "eval/evaluate.h"
#include "report/report_files.h"

namespace pangea {
namespace {

// Points with a larger relative sigma of the depth are not drawn.
constexpr double kMaxRelativeSigma = 0.3;

struct PlyPoint {
  Eigen::Vector3d p_map;
  double relative_sigma = 0;
};

// The points of all keyframes of one map: landmarks by id, then points without landmark.
std::vector<Eigen::Vector3d> PointsOf(const CapturedSession& session, const FinalGroup& group,
                                      const MapId& map) {
  std::map<int32_t, PlyPoint> landmarks;
  std::vector<Eigen::Vector3d> points;
  const auto first =
      std::ranges::lower_bound(group.keyframes, KeyframeId{map, 0}, {}, &FinalKeyframe::id);
  for (auto it = first; it != group.keyframes.end() && it->id.map == map; ++it) {
    const FinalKeyframe& keyframe = *it;
    const auto captured = session.keyframes.find(keyframe.id);
    if (captured == session.keyframes.end()) {
      continue;
    }
    for (const CapturedPoint& point : captured->second.points) {
      if (point.relative_sigma > kMaxRelativeSigma) {
        continue;
      }
      const PlyPoint candidate{keyframe.T_map_body * point.p_body, point.relative_sigma};
      if (point.landmark_id == kNoLandmark) {
        points.push_back(candidate.p_map);
        continue;
      }
      const auto [best, inserted] = landmarks.try_emplace(point.landmark_id, candidate);
      if (!inserted && candidate.relative_sigma < best->second.relative_sigma) {
        best->second = candidate;
      }
    }
  }
  for (const auto& [id, point] : landmarks) {
    points.push_back(point.p_map);
  }
  return points;
}

std::array<uint8_t, 3> Rgb(const std::string& colour) {
  const int value = std::stoi(colour.substr(1), nullptr, 16);
  return {static_cast<uint8_t>(value >> 16), static_cast<uint8_t>(value >> 8),
          static_cast<uint8_t>(value)};
}

void AddGroup(const ReportMetrics& metrics, const GroupMetrics& group, Plot* plot) {
  const TrajectoryAlignment alignment =
      group.joint ? group.joint->alignment : TrajectoryAlignment();
  for (const int32_t agent_id : group.group.Agents()) {
    const size_t index = metrics.IndexOf(agent_id);
    // An agent of an earlier session may be in the group and not in the log.
    const std::set<MapId> of_recording =
        index < metrics.agents.size() ? metrics.agents[index].recording_maps : std::set<MapId>();
    std::string label = fmt::format("agent {}", agent_id);
    const auto with_truth = std::ranges::find(group.joint_agents, agent_id);
    if (group.joint && with_truth != group.joint_agents.end()) {
      const auto i = static_cast<size_t>(with_truth - group.joint_agents.begin());
      label += fmt::format(" ({:.3f} m)", group.joint->agents[i].position_m.rmse);
    }
    const auto add = [&](const std::string& text, const std::set<MapId>& maps, double width) {
      std::vector<Eigen::Vector2d> points = TopView(group.group.TrajectoryOf(maps), alignment);
      if (!points.empty()) {
        plot->lines.push_back({.label = text,
                               .colour = AgentColour(index),
                               .width = width,
                               .points = std::move(points),
                               .mark_start = true});
      }
    };
    add(label, of_recording, 2.5);
    for (const MapId& map : group.group.maps) {
      if (map.agent_id == agent_id && !of_recording.contains(map)) {
        add(fmt::format("agent {}, map {}", agent_id, ToString(map)), {map}, 1.5);
      }
    }
  }
}

Plot TopViewPlot(const std::string& title) {
  return {.title = title, .x_label = "x [m]", .y_label = "y [m]", .equal_axes = true};
}

std::string GroupTitle(const GroupMetrics& group) {
  const std::vector<int32_t> agents = group.group.Agents();
  return agents.size() == 1 ? fmt::format("agent {}", agents.front())
                            : fmt::format("agents {} fused", fmt::join(agents, ", "));
}

Picture AllWithGroundTruth(const ReportMetrics& metrics) {
  Picture picture{TrajectoryPicture(), TopViewPlot("")};
  for (const AgentMetrics& agent : metrics.agents) {
    if (!agent.ground_truth.empty()) {
      picture.plot.lines.push_back({.label = picture.plot.lines.empty() ? "ground truth" : "",
                                    .name = "ground truth",
                                    .colour = kGroundTruthColour,
                                    .width = 5,
                                    .points = TopView(agent.ground_truth, TrajectoryAlignment())});
    }
  }
  std::string title;
  for (const GroupMetrics& group : metrics.groups) {
    if (group.joint) {
      title += fmt::format("{}{}: ATE {:.3f} m", title.empty() ? "" : "; ", GroupTitle(group),
                           group.joint->position_m.rmse);
      AddGroup(metrics, group, &picture.plot);
    }
  }
  picture.plot.title = title;
  return picture;
}

Picture ErrorPicture(const ReportMetrics& metrics) {
  Picture picture{kErrorPicture,
                  {.title = "position error",
                   .x_label = "time since the ground truth's beginning [s]",
                   .y_label = "position error [m]",
                   .y_from_zero = true}};
  for (size_t i = 0; i < metrics.agents.size(); ++i) {
    const AgentMetrics& agent = metrics.agents[i];
    if (agent.ground_truth.empty()) {
      continue;
    }
    const int64_t begin = agent.ground_truth.front().utime;
    if (agent.vio) {
      picture.plot.lines.push_back(
          {.label = fmt::format("agent {} alone ({:.3f} m)", agent.id, agent.vio->position_m.rmse),
           .colour = AgentColour(i),
           .width = 1.5,
           .dashed = true,
           .points = ErrorOverTime(agent.vio->errors, begin)});
    }
    if (agent.server) {
      picture.plot.lines.push_back({.label = fmt::format("agent {} with server ({:.3f} m)",
                                                         agent.id, agent.server->position_m.rmse),
                                    .colour = AgentColour(i),
                                    .width = 2.5,
                                    .points = ErrorOverTime(agent.server->errors, begin)});
    }
  }
  if (picture.plot.lines.empty()) {
    picture.plot.title = "no ground truth, so no error";
  }
  return picture;
}

}  // namespace

std::vector<ColouredPoint> MapPoints(const CapturedSession& session, const ReportMetrics& metrics,
                                     const FinalGroup& group) {
  std::vector<ColouredPoint> points;
  for (const MapId& map : group.maps) {
    const std::array<uint8_t, 3> rgb = Rgb(AgentColour(metrics.IndexOf(map.agent_id)));
    for (const Eigen::Vector3d& p_map : PointsOf(session, group, map)) {
      points.push_back({p_map, rgb});
    }
  }
  return points;
}

std::string MapPly(const CapturedSession& session, const ReportMetrics& metrics,
                   const FinalGroup& group) {
  const std::vector<ColouredPoint> points = MapPoints(session, metrics, group);
  std::string body;
  for (const auto& [p, rgb] : points) {
    body +=
        fmt::format("{:.4f} {:.4f} {:.4f} {} {} {}\n", p.x(), p.y(), p.z(), rgb[0], rgb[1], rgb[2]);
  }
  return fmt::format(
      "ply\nformat ascii 1.0\ncomment map frame: odom of map {}, metres, z up\nelement vertex {}\n"
      "property float x\nproperty float y\nproperty float z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n{}",
      ToString(group.frame), points.size(), body);
}

std::vector<Picture> Pictures(const ReportMetrics& metrics) {
  std::vector<Picture> pictures;
  const bool any_placed = std::ranges::any_of(
      metrics.groups, [](const GroupMetrics& g) { return g.joint.has_value(); });
  if (any_placed || metrics.groups.empty()) {
    pictures.push_back(AllWithGroundTruth(metrics));
  }
  for (const GroupMetrics& group : metrics.groups) {
    if (!group.joint) {
      const std::string file =
          pictures.empty() ? TrajectoryPicture() : TrajectoryPicture(group.group.frame);
      pictures.push_back({file, TopViewPlot(GroupTitle(group) + ", in the group's map frame")});
      AddGroup(metrics, group, &pictures.back().plot);
    }
  }
  pictures.push_back(ErrorPicture(metrics));
  return pictures;
}

}  // namespace pangea
