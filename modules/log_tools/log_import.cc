#include "log_tools/log_import.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <utility>
#include <vector>

#include "log_file/log_reader.h"
#include "log_tools/log_edit.h"
#include "log_tools/log_export.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/messages.h"
#include "messages/messages_checks.h"
#include "report/metrics/report_groups.h"

namespace pangea {
namespace {

void CheckVertices(const NamedGraph& exported, const Graph& solved, const std::string& g2o) {
  const auto num_keyframes = std::ssize(exported.keyframes);
  for (const auto& [number, pose] : solved.vertices) {
    if (number < 0 || number >= num_keyframes) {
      throw std::runtime_error(
          fmt::format("{}: vertex {} is none of the log's {} keyframes; is it of another log?", g2o,
                      number, num_keyframes));
    }
  }
  for (int number = 0; number < num_keyframes; ++number) {
    if (!solved.vertices.contains(number)) {
      throw std::runtime_error(
          fmt::format("{}: vertex {}, keyframe {}, is missing; is it of another log?", g2o, number,
                      ToString(exported.keyframes[static_cast<size_t>(number)])));
    }
  }
}

// A group's last state in the log, with the solved poses; `next`: the group's first vertex.
MapState Solved(const FinalGroup& group, const CapturedSession& session, const Graph& graph,
                int* next) {
  MapState state;
  const auto last = session.states.find(group.frame);
  if (last != session.states.end()) {
    state = *last->second;
  }
  state.group = group.frame;
  state.maps = group.maps;
  ++state.revision;
  state.keyframes.clear();
  for (const FinalKeyframe& keyframe : group.keyframes) {
    state.keyframes.push_back({keyframe.id, keyframe.utime, graph.vertices.at((*next)++)});
  }
  return state;
}

// The messages of every group's new state.
std::vector<map_state_t> Chunks(const CapturedSession& session,
                                const std::vector<FinalGroup>& groups, const Graph& solved,
                                const std::string& g2o) {
  std::vector<map_state_t> chunks;
  int next = 0;
  for (const FinalGroup& group : groups) {
    for (map_state_t& chunk : ToMessages(Solved(group, session, solved, &next))) {
      if (const auto read = Parse(chunk); !read.value) {
        throw std::runtime_error(fmt::format("{}: the group of map {} cannot be placed so: {}", g2o,
                                             ToString(group.frame), read.refused));
      }
      chunks.push_back(std::move(chunk));
    }
  }
  return chunks;
}

}  // namespace

ImportedG2o ImportG2o(const std::string& log, const std::string& g2o, const std::string& out,
                      LogReadings* readings) {
  Graph solved = ReadG2o(g2o, messages_checks::kMaxDistance);
  const NamedGraph exported = GraphOf(log, readings);
  CheckVertices(exported, solved, g2o);
  const CapturedSession session = ReadServerLog(log, readings);
  const std::vector<FinalGroup> groups = FinalGroups(session);
  SolvedPoses poses = PlaceInMapFrames(exported.graph, groups, g2o, &solved);
  const std::vector<map_state_t> chunks = Chunks(session, groups, solved, g2o);
  NewLog made(out);
  int64_t latest = 0;
  const auto copy = [&](const LogEvent& event) {
    latest = std::max(latest, event.utime);
    made.Write(event.utime, event.channel, event.data);
  };
  ReadLog(log, copy, readings);
  for (const map_state_t& chunk : chunks) {
    made.Write(++latest, std::string(channels::kMapState), EncodeMessage(chunk));
  }
  made.Keep();
  return {std::ssize(solved.vertices), std::move(poses)};
}

}  // namespace pangea
