#include "report/metrics/report_metrics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <set>
#include <stdexcept>

#include "recording/euroc.h"
#include "report/metrics/recording_maps.h"

namespace pangea {
namespace {

// Share of the images after the start. With fewer poses the report has a note.
constexpr double kFewPosesShare = 0.9;

std::map<int32_t, AgentRun> Runs(const ReportInput& input, const CapturedSession& session) {
  std::map<int32_t, AgentRun> runs;
  for (const AgentRun& run : input.agents) {
    runs[run.id] = run;
  }
  for (const auto& [id, keyframe] : session.keyframes) {
    runs[id.map.agent_id].id = id.map.agent_id;
  }
  return runs;
}

// Stamp of the first image played; empty without a readable recording.
std::optional<int64_t> PlayedFrom(const AgentRun& run) {
  const auto first = run.recording.empty() ? std::nullopt : FirstImageUtimeOf(run.recording);
  return first ? std::optional(*first + std::llround(1e6 * run.start_s)) : std::nullopt;
}

void ReadGroundTruth(const AgentRun& run, AgentMetrics* agent, std::vector<std::string>* notes) {
  if (run.recording.empty()) {
    notes->push_back(fmt::format("agent {}: no recording is known, so no error", run.id));
    return;
  }
  std::vector<std::string> warnings;
  try {
    agent->ground_truth = ReadEurocGroundTruthOf(run.recording, &warnings);
  } catch (const std::runtime_error& error) {
    warnings.emplace_back(error.what());
  }
  for (const std::string& warning : warnings) {
    notes->push_back(fmt::format("agent {}: {}", run.id, warning));
  }
  if (agent->ground_truth.empty()) {
    notes->push_back(
        fmt::format("agent {}: {} has no ground truth, so no error", run.id, run.recording));
    return;
  }
  const auto from = PlayedFrom(run);
  if (from && (run.start_s > 0 || run.duration_s)) {
    const int64_t to = run.duration_s ? *from + std::llround(1e6 * *run.duration_s)
                                      : agent->ground_truth.back().utime;
    std::erase_if(agent->ground_truth,
                  [&](const StampedPose& p) { return p.utime < *from || p.utime > to; });
    if (agent->ground_truth.empty()) {
      notes->push_back(fmt::format(
          "agent {}: none of its ground truth is of the part played, so no error", run.id));
    }
  }
}

std::map<MapId, int64_t> FusedRevisions(const CapturedSession& session) {
  std::map<MapId, int64_t> revisions;
  for (const GroupChange& change : session.changes) {
    for (const MapId& map : change.maps) {
      if (change.maps.size() > 1) {
        const auto known = revisions.try_emplace(map, change.revision).first;
        known->second = std::min(known->second, change.revision);
      }
    }
  }
  return revisions;
}

void NoteFewPoses(const PoseTrack& track, int32_t agent_id, std::vector<std::string>* notes) {
  const int64_t images = track.images + track.images_dropped;
  const double share = static_cast<double>(track.poses) / static_cast<double>(images);
  if (track.poses == 0 || share >= kFewPosesShare) {
    return;
  }
  std::string note = fmt::format(
      "agent {}: few poses: {} of its {} images after the start have one ({:.0f} %); "
      "POSE_{}.reason says why the others have none",
      agent_id, track.poses, images, 100 * share, agent_id);
  if (track.images_dropped > 0) {
    note += fmt::format("; {} were dropped, as the odometry was too slow for real time",
                        track.images_dropped);
  }
  notes->push_back(std::move(note));
}

// All maps of the agent, also those of earlier sessions.
std::set<MapId> MapsOf(const AgentMetrics& agent, const MapSpans& spans) {
  std::set<MapId> maps;
  for (const auto& [map, odometry] : agent.odometry) {
    maps.insert(map);
  }
  for (const auto& [map, span] : spans) {
    if (map.agent_id == agent.id) {
      maps.insert(map);
    }
  }
  return maps;
}

void ReadOdometry(const CapturedSession& session, const MapSpans& spans, AgentMetrics* agent,
                  std::vector<std::string>* notes, LogReadings* readings) {
  AgentRun& run = agent->run;
  PoseTrack track;
  if (!run.bus_log.empty() && std::filesystem::exists(run.bus_log)) {
    track = ReadPoses(run.bus_log, run.id, readings);
    run.maps = std::move(track.maps);  // nothing else publishes on the agent's bus
    NoteFewPoses(track, run.id, notes);
  }
  agent->odometry = std::move(track.odometry);
  agent->samples = std::move(track.samples);
  agent->anchors = std::move(track.anchors);
  agent->live = LiveMetricsOf(track.live, FusedRevisions(session), agent->ground_truth);
  agent->odometry_at_camera_rate = !agent->odometry.empty();
  const std::set<MapId> maps = MapsOf(*agent, spans);
  agent->maps.assign(maps.begin(), maps.end());
  agent->recording_maps = MapsOfRecording(run, maps, spans, notes);
  std::optional<int64_t> first_pose = track.first_tracking_utime;
  if (!agent->odometry_at_camera_rate) {
    for (const auto& [id, keyframe] : session.keyframes) {
      if (id.map.agent_id == run.id) {
        agent->odometry[id.map].push_back({keyframe.utime, keyframe.T_odom_body});
      }
      if (agent->recording_maps.contains(id.map)) {
        first_pose = std::min(first_pose.value_or(keyframe.utime), keyframe.utime);
      }
    }
    for (auto& [map, odometry] : agent->odometry) {
      SortByTime(&odometry);
    }
    notes->push_back(fmt::format(
        "agent {}: no camera-rate poses were captured; its odometry is that of its keyframes",
        run.id));
  }
  for (const auto& [map, odometry] : agent->odometry) {
    agent->path_m += agent->recording_maps.contains(map) ? PathLength(odometry) : 0;
  }
  const auto from = PlayedFrom(run);
  const auto begin = from ? from : track.first_utime;
  if (begin && first_pose) {
    agent->initialised_s = 1e-6 * static_cast<double>(*first_pose - *begin);
  }
}

// Main group and main map are chosen among the maps of the recording; if none of them is in the
// log, among all.
void ChooseMain(const std::vector<GroupMetrics>& groups, AgentMetrics* agent) {
  const std::set<MapId> all(agent->maps.begin(), agent->maps.end());
  const std::set<MapId>& maps = agent->recording_maps.empty() ? all : agent->recording_maps;
  size_t most = 0;
  for (size_t i = 0; i < groups.size(); ++i) {
    const size_t count = groups[i].group.CountOf(maps);
    if (count > most) {
      most = count;
      agent->group = i;
    }
    agent->keyframes += groups[i].group.CountOf(agent->id);
  }
  if (most == 0) {  // no keyframe arrived
    agent->main_map = maps.empty() ? MapId() : *maps.begin();
    return;
  }
  const FinalGroup& group = groups[agent->group].group;
  size_t longest = 0;
  for (const MapId& map : maps) {
    const size_t length = group.CountOf(std::set<MapId>{map});
    if (length > longest) {
      longest = length;
      agent->main_map = map;
    }
  }
  std::ranges::set_intersection(
      agent->recording_maps, group.maps,
      std::inserter(agent->trajectory_maps, agent->trajectory_maps.end()));
  agent->trajectory_maps.insert(agent->main_map);
}

// The sum of a count over all starts of its process, each of which counts from zero.
std::optional<int64_t> TotalOf(const std::vector<ProcessSample>& samples,
                               std::optional<int64_t> ProcessSample::*count) {
  std::optional<int64_t> total;
  int64_t before = 0;
  for (const ProcessSample& sample : samples) {
    if (const auto now = sample.*count) {
      total = total.value_or(0) + (*now < before ? *now : *now - before);
      before = *now;
    }
  }
  return total;
}

// The session has counted only what the uplink's last start did.
void CountBytes(AgentMetrics* agent) {
  const auto uplink = agent->samples.find(fmt::format("uplink_{}", agent->id));
  if (uplink != agent->samples.end()) {
    AgentRun& run = agent->run;
    run.bytes_up = std::max(run.bytes_up, TotalOf(uplink->second, &ProcessSample::bytes_up));
    run.bytes_down = std::max(run.bytes_down, TotalOf(uplink->second, &ProcessSample::bytes_down));
  }
}

AgentMetrics MetricsOf(const AgentRun& run, const CapturedSession& session,
                       const std::vector<GroupMetrics>& groups, const MapSpans& spans,
                       std::vector<std::string>* notes, LogReadings* readings) {
  AgentMetrics agent;
  agent.id = run.id;
  agent.run = run;
  ReadGroundTruth(run, &agent, notes);
  ReadOdometry(session, spans, &agent, notes, readings);
  CountBytes(&agent);
  ChooseMain(groups, &agent);
  if (agent.ground_truth.empty() || agent.recording_maps.empty()) {
    return agent;
  }
  const Trajectory keyframes =
      groups.empty() ? Trajectory() : groups[agent.group].group.TrajectoryOf(agent.recording_maps);
  const Trajectory& odometry = agent.odometry[agent.main_map];
  const std::vector<PosePair> pairs = Associate(odometry, agent.ground_truth);
  if (!odometry.empty() && pairs.size() < kMinPairs) {
    notes->push_back(fmt::format(
        "agent {}: {} of its {} poses have ground truth at their time, so no error; between two "
        "of its poses more than {:g} s apart ground truth is not used",
        run.id, pairs.size(), odometry.size(), 1e-6 * kMaxGroundTruthGapUs));
  }
  agent.vio = AbsoluteError(pairs, TrajectoryAlignmentKind::kSe3);
  agent.server =
      AbsoluteError(Associate(keyframes, agent.ground_truth), TrajectoryAlignmentKind::kSe3);
  agent.coverage = Coverage(keyframes, agent.ground_truth);
  return agent;
}

void AddJoint(const std::vector<AgentMetrics>& agents, GroupMetrics* metrics) {
  std::vector<std::vector<PosePair>> pairs;
  for (const AgentMetrics& agent : agents) {
    auto with_truth =
        Associate(metrics->group.TrajectoryOf(agent.recording_maps), agent.ground_truth);
    if (!with_truth.empty()) {
      pairs.push_back(std::move(with_truth));
      metrics->joint_agents.push_back(agent.id);
    }
  }
  metrics->joint = JointAbsoluteError(pairs, TrajectoryAlignmentKind::kSe3);
}

void AddConstraints(const CapturedSession& session, ReportMetrics* metrics) {
  std::map<MapId, const Trajectory*> ground_truth;
  for (const AgentMetrics& agent : metrics->agents) {
    for (const MapId& map : agent.recording_maps) {
      ground_truth[map] = &agent.ground_truth;
    }
  }
  const auto all = ConstraintsWithTruth(session, ground_truth);
  std::vector<ConstraintWithTruth> inter;
  std::vector<ConstraintWithTruth> intra;
  for (const ConstraintWithTruth& known : all) {
    (known.constraint.from.map == known.constraint.to.map ? intra : inter).push_back(known);
  }
  metrics->all_constraints = CheckConstraints(all);
  metrics->inter_constraints = CheckConstraints(inter);
  metrics->intra_constraints = CheckConstraints(intra);
}

void AddAnchors(const ReportInput& input, const CapturedSession& session, ReportMetrics* metrics) {
  std::vector<AnchorViewer> viewers;
  for (const AgentMetrics& agent : metrics->agents) {
    viewers.push_back(
        {agent.id, &agent.anchors, &agent.odometry, &agent.ground_truth, &agent.recording_maps});
  }
  metrics->anchors = AnchorsOf(session, viewers, input.anchors);
}

}  // namespace

bool AgentMetrics::AteCounts() const {
  return server && coverage && *coverage >= 0.95 && recording_maps.size() == 1;
}

size_t ReportMetrics::IndexOf(int32_t agent_id) const {
  return static_cast<size_t>(std::ranges::find(agents, agent_id, &AgentMetrics::id) -
                             agents.begin());
}

ReportMetrics ComputeMetrics(const ReportInput& input, const CapturedSession& session,
                             LogReadings* readings) {
  ReportMetrics metrics;
  metrics.notes = input.notes;
  for (const auto& [channel, refused] : session.refused) {
    metrics.notes.push_back(fmt::format("{} messages on {} are refused and ignored; the first: {}",
                                        refused.count, channel, refused.first_reason));
  }
  if (session.incomplete_states > 0) {
    metrics.notes.push_back(
        fmt::format("{} MAP_STATE lack a chunk in the log; ignored", session.incomplete_states));
  }
  if (LacksStates(session)) {
    metrics.notes.emplace_back(kLacksStates);
  }
  for (const auto& [process, count] : input.restarts) {
    metrics.notes.push_back(fmt::format("{} died and was restarted{}", process,
                                        count == 1 ? "" : fmt::format(", {} times", count)));
  }
  std::vector<FinalGroup> groups = FinalGroups(session);
  const MapSpans spans = SpansOf(groups);
  for (FinalGroup& group : groups) {
    metrics.groups.push_back({std::move(group), std::nullopt, {}});
  }
  for (const auto& [id, run] : Runs(input, session)) {
    metrics.agents.push_back(
        MetricsOf(run, session, metrics.groups, spans, &metrics.notes, readings));
  }
  for (GroupMetrics& group : metrics.groups) {
    AddJoint(metrics.agents, &group);
  }
  AddConstraints(session, &metrics);
  AddAnchors(input, session, &metrics);
  metrics.lost = readings == nullptr ? std::vector<std::string>() : LossLines(*readings);
  return metrics;
}

}  // namespace pangea
