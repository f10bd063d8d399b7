#include "report/report_json.h"

#include <fmt/format.h>

#include <cmath>

#include "report/metrics/report_counts.h"

namespace pangea {
namespace {

using nlohmann::ordered_json;

// Rounds to a microsecond or micrometre: further digits are meaningless.
ordered_json Number(double value) { return std::round(value * 1e6) / 1e6; }
ordered_json Number(const std::optional<double>& value) {
  return value ? Number(*value) : ordered_json();
}
ordered_json Rmse(const std::optional<Ate>& ate) {
  return ate ? Number(ate->position_m.rmse) : ordered_json();
}

ordered_json NormalisedJson(const NormalisedError& error, bool any) {
  if (!any) {
    return {};
  }
  return {{"mean", Number(error.mean)},
          {"median", Number(error.median)},
          {"share_above_99", Number(error.share_above_99)}};
}

ordered_json TruthJson(const ConstraintsTruth& truth) {
  const bool any = truth.checked > 0;
  const auto metres = [any](double value) { return any ? Number(value) : ordered_json(); };
  return {{"checked", truth.checked},
          {"wrong", truth.wrong},
          {"precision", Number(truth.Precision())},
          {"nees_per_dim", NormalisedJson(truth.pose, any)},
          {"nees_per_dim_position", NormalisedJson(truth.position, any)},
          {"nees_yaw", NormalisedJson(truth.yaw, any)},
          {"translation_median_m", metres(truth.translation_median_m)},
          {"translation_p95_m", metres(truth.translation_p95_m)}};
}

ordered_json MapIds(const std::vector<MapId>& maps) {
  ordered_json ids = ordered_json::array();
  for (const MapId& map : maps) {
    ids.push_back(ToString(map));
  }
  return ids;
}

// The maps that were not made from its recording.
std::vector<MapId> NotCompared(const AgentMetrics& agent) {
  std::vector<MapId> maps = agent.maps;
  std::erase_if(maps, [&agent](const MapId& map) { return agent.recording_maps.contains(map); });
  return maps;
}

ordered_json LinkJson(const AgentRun& run) {
  if (!run.link) {
    return {};
  }
  return {{"conditions", run.link->conditions},
          {"packets_up", run.link->packets_up},
          {"packets_down", run.link->packets_down}};
}

ordered_json AgentJson(const AgentMetrics& agent) {
  const AgentRun& run = agent.run;
  return {{"id", agent.id},
          {"map_ids", MapIds(agent.maps)},
          {"map_ids_not_compared", MapIds(NotCompared(agent))},
          {"keyframes", agent.keyframes},
          {"initialised_s", Number(agent.initialised_s)},
          {"path_m", Number(agent.path_m)},
          {"ate_vio_m", Rmse(agent.vio)},
          {"ate_server_m", Rmse(agent.server)},
          {"coverage", Number(agent.coverage)},
          {"ate_live_m", Number(agent.live.ate_m)},
          {"ate_live_raw_m", Number(agent.live.ate_raw_m)},
          {"live_jump_max_m", Number(agent.live.jump_max_m)},
          {"bytes_up", run.bytes_up ? ordered_json(*run.bytes_up) : ordered_json()},
          {"bytes_down", run.bytes_down ? ordered_json(*run.bytes_down) : ordered_json()},
          {"kb_per_s_up", Number(KilobytesPerSecondUp(agent))},
          {"link", LinkJson(run)},
          {"realtime_factor", Number(run.realtime_factor)}};
}

ordered_json JointJson(const GroupMetrics& group) {
  return group.joint ? Number(group.joint->position_m.rmse) : ordered_json();
}

ordered_json ChangeJson(const GroupChange& change, const ReportMetrics& metrics) {
  ordered_json json = {{"change", change.fused ? "fused" : "taken apart"},
                       {"session_s", Number(change.session_s)}};
  json["agents"] = FinalGroup{{}, change.maps, {}, 0}.Agents();
  json["map_ids"] = MapIds(change.maps);
  json["recording_s"] = ordered_json::object();
  for (const auto& [agent, seconds] : RecordingSeconds(metrics, change)) {
    json["recording_s"][fmt::format("{}", agent)] = Number(seconds);
  }
  return json;
}

ordered_json ProcessesJson(const ReportInput& input, const CapturedSession& session) {
  ordered_json processes = ordered_json::object();
  for (const auto& [name, status] : session.statuses) {
    ordered_json& process = processes[name];
    process = {{"messages_in", status.messages_in},
               {"messages_out", status.messages_out},
               {"dropped", status.dropped},
               {"handling_median_ms", Number(status.handling_median_ms)},
               {"handling_p99_ms", Number(status.handling_p99_ms)},
               {"memory_mb", Number(status.memory_mb)},
               {"cpu_s", Number(status.cpu_s)}};
    for (const counter_t& refused : status.refused) {
      process["refused"][refused.name] = refused.count;
    }
  }
  for (const auto& [name, factor] : input.realtime_factors) {
    processes[name]["realtime_factor"] = Number(factor);
  }
  for (const auto& [name, count] : input.restarts) {
    processes[name]["restarts"] = count;
  }
  return processes;
}

ordered_json AnchorAtAgentJson(const AnchorAtAgent& at) {
  return {{"id", at.agent},
          {"error_m", Number(at.error_m)},
          {"error_px", Number(at.error_px)},
          {"largest_jump_m", Number(at.largest_jump_m)},
          {"error_at_fusion_m", Number(at.error_at_fusion_m)},
          {"error_10s_m", Number(at.error_10s_m)},
          {"error_end_m", Number(at.error_end_m)},
          {"error_max_m", Number(at.error_max_m)},
          {"error_unblended_m", Number(at.error_unblended_m)},
          {"reason", at.reason.empty() ? ordered_json() : ordered_json(at.reason)}};
}

ordered_json AnchorJson(const AnchorMetrics& anchor) {
  ordered_json json = {{"name", anchor.name},
                       {"id", anchor.id ? ordered_json(ToString(*anchor.id)) : ordered_json()},
                       {"made_by", anchor.made_by},
                       {"placed", anchor.placed},
                       {"agents", ordered_json::array()}};
  for (const AnchorAtAgent& at : anchor.agents) {
    json["agents"].push_back(AnchorAtAgentJson(at));
  }
  return json;
}

}  // namespace

ordered_json ReportJson(const ReportInput& input, const CapturedSession& session,
                        const ReportMetrics& metrics) {
  ordered_json json;
  json["agents"] = ordered_json::array();
  for (const AgentMetrics& agent : metrics.agents) {
    json["agents"].push_back(AgentJson(agent));
  }
  json["groups"] = ordered_json::array();
  for (const GroupMetrics& group : metrics.groups) {
    json["groups"].push_back({{"agents", group.group.Agents()},
                              {"map_ids", MapIds(group.group.maps)},
                              {"keyframes", group.group.keyframes.size()},
                              {"constraints_switched_off", group.group.num_switched_off},
                              {"ate_joint_m", JointJson(group)}});
  }
  // The first group has the most agents.
  json["ate_joint_m"] = metrics.groups.empty() ? ordered_json() : JointJson(metrics.groups.front());
  const ConstraintCounts counts = CountConstraints(session);
  json["constraints"] = {
      {"accepted", counts.num_accepted()},       {"accepted_inter", counts.accepted_inter},
      {"accepted_intra", counts.accepted_intra}, {"accepted_derived", counts.accepted_derived},
      {"refused", counts.num_refused},           {"refused_by_reason", counts.refused}};
  json["constraints_truth"] = TruthJson(metrics.all_constraints);
  json["constraints_truth"]["inter"] = TruthJson(metrics.inter_constraints);
  json["constraints_truth"]["intra"] = TruthJson(metrics.intra_constraints);
  json["fused_at"] = ordered_json::array();
  for (const GroupChange& change : session.changes) {
    json["fused_at"].push_back(ChangeJson(change, metrics));
  }
  json["anchors"] = ordered_json::array();
  for (const AnchorMetrics& anchor : metrics.anchors) {
    json["anchors"].push_back(AnchorJson(anchor));
  }
  json["processes"] = ProcessesJson(input, session);
  json["lost"] = metrics.lost;
  json["notes"] = metrics.notes;
  return json;
}

}  // namespace pangea
