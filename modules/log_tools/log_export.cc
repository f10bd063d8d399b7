#include "log_tools/log_export.h"

#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <set>
#include <stdexcept>

#include "files/text_file.h"
#include "log_file/log_reader.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/messages.h"
#include "report/metrics/recording_maps.h"
#include "report/metrics/report_groups.h"
#include "report/metrics/report_metrics.h"
#include "report/report_files.h"
#include "report/report_pictures.h"

namespace pangea {
namespace {

// The odometry edges of the log's keyframes, by the keyframe at their end.
std::map<KeyframeId, OdometryEdge> OdometryEdges(const std::string& log, LogReadings* readings) {
  std::map<KeyframeId, OdometryEdge> edges;
  const auto add = [&edges](const LogEvent& event) {
    if (event.channel.starts_with(channels::kKeyframePrefix)) {
      const auto keyframe = ParseMessage<KeyframeMessage>(event.data).value;
      if (keyframe && keyframe->edge) {
        edges.emplace(keyframe->id, *keyframe->edge);
      }
    }
  };
  ReadLog(log, add, readings);
  return edges;
}

class GraphBuilder {
 public:
  void AddVertices(const FinalGroup& group) {
    bool first = true;
    for (const FinalKeyframe& keyframe : group.keyframes) {
      const int number = static_cast<int>(graph_.keyframes.size());
      numbers_.emplace(keyframe.id, number);
      graph_.graph.vertices.emplace(number, keyframe.T_map_body);
      graph_.keyframes.push_back(keyframe.id);
      if (first && keyframe.id.map == group.frame) {
        graph_.graph.fixed.push_back(number);
        first = false;
      }
    }
  }

  // An edge to a keyframe without a pose in the log is left out.
  void AddEdge(const KeyframeId& from, const KeyframeId& to, const Rigid3& T_from_to,
               const Matrix6d& covariance) {
    const auto a = numbers_.find(from), b = numbers_.find(to);
    if (a != numbers_.end() && b != numbers_.end()) {
      graph_.graph.edges.push_back({a->second, b->second, T_from_to, covariance});
    }
  }

  NamedGraph Take() { return std::move(graph_); }

 private:
  NamedGraph graph_;
  std::map<KeyframeId, int> numbers_;
};

}  // namespace

std::vector<std::string> ExportTum(const std::string& log, const std::string& folder,
                                   LogReadings* readings) {
  const std::vector<FinalGroup> groups = FinalGroups(ReadServerLog(log, readings));
  if (groups.empty()) {
    throw std::runtime_error(fmt::format(
        "{}: no KEYFRAME_* and no MAP_STATE in this log, so no trajectory; give that of a server's "
        "bus: session.lcm, journal.lcm",
        log));
  }
  std::filesystem::create_directories(folder);
  const MapSpans spans = SpansOf(groups);
  std::vector<std::string> files;
  std::set<int32_t> with_file;
  for (const FinalGroup& group : groups) {
    for (const int32_t agent : group.Agents()) {
      // Groups are sorted by number of agents, so the agent's first group is the largest.
      for (const std::set<MapId>& maps : TrajectoriesOf(group, agent, spans)) {
        const std::string name = with_file.insert(agent).second
                                     ? TrajectoryFile(agent)
                                     : TrajectoryFile(agent, *maps.begin());
        files.push_back(fmt::format("{}/{}", folder, name));
        WriteTum(files.back(), group.TrajectoryOf(maps));
      }
    }
  }
  return files;
}

std::string RemarkOnExport(const std::string& log, LogReadings* readings) {
  return LacksStates(ReadServerLog(log, readings)) ? fmt::format("{}: {}", log, kLacksStates)
                                                   : std::string();
}

void ExportPly(const std::string& log, const std::string& file, LogReadings* readings) {
  const CapturedSession session = ReadServerLog(log, readings);
  const ReportMetrics metrics = ComputeMetrics({.server_log = log}, session);
  WriteTextFile(file, MapPly(session, metrics,
                             metrics.groups.empty() ? FinalGroup() : metrics.groups.front().group));
}

NamedGraph GraphOf(const std::string& log, LogReadings* readings) {
  const CapturedSession session = ReadServerLog(log, readings);
  GraphBuilder builder;
  for (const FinalGroup& group : FinalGroups(session)) {
    builder.AddVertices(group);
  }
  for (const auto& [id, edge] : OdometryEdges(log, readings)) {
    builder.AddEdge({id.map, edge.from_seq}, id, edge.T_from_this, edge.covariance);
  }
  for (const auto& [id, constraint] : session.constraints) {
    if (constraint.accepted) {
      builder.AddEdge(constraint.from, constraint.to, constraint.T_from_to, constraint.covariance);
    }
  }
  return builder.Take();
}

}  // namespace pangea
