#include "session/report_text.h"

#include <fmt/format.h>

#include <cctype>
#include <cmath>
#include <nlohmann/json.hpp>

#include "eval/table.h"

namespace pangea::session {
namespace {

using nlohmann::ordered_json;

// A microsecond, a micrometre: no more digits than mean something.
ordered_json Number(double value) { return std::round(value * 1e6) / 1e6; }
ordered_json Number(const std::optional<double>& value) {
  return value ? Number(*value) : ordered_json();
}
ordered_json Rmse(const std::optional<Ate>& ate) {
  return ate ? Number(ate->position_m.rmse) : ordered_json();
}

std::string Cell(const std::optional<double>& value, int decimals) {
  return value ? fmt::format("{:.{}f}", *value, decimals) : "-";
}
std::string Cell(const std::optional<Ate>& ate) {
  return ate ? fmt::format("{:.3f}", ate->position_m.rmse) : "-";
}

std::string Joined(const std::vector<MapId>& maps) {
  std::string text;
  for (const MapId& map : maps) {
    text += fmt::format("{}{}", text.empty() ? "" : ", ", ToString(map));
  }
  return text;
}

// Recording time played: of its link bytes, what a second of it costs.
std::optional<double> PlayedSeconds(const AgentFigures& agent) {
  int64_t begin = 0;
  int64_t end = 0;
  for (const auto& [map, odometry] : agent.odometry) {
    if (!odometry.empty()) {
      begin = begin == 0 ? odometry.front().utime : std::min(begin, odometry.front().utime);
      end = std::max(end, odometry.back().utime);
    }
  }
  const double seconds =
      1e-6 * static_cast<double>(end - begin) + std::max(0.0, agent.initialised_s.value_or(0));
  return seconds > 0 ? std::optional(seconds) : std::nullopt;
}

std::optional<double> KilobytesPerSecondUp(const AgentFigures& agent) {
  const auto seconds = PlayedSeconds(agent);
  if (!seconds || !agent.run.bytes_up) {
    return std::nullopt;
  }
  return 1e-3 * static_cast<double>(*agent.run.bytes_up) / *seconds;
}

// Refused for the same reason, whatever the figures in it.
std::string WithoutFigures(const std::string& reason) {
  std::string text;
  for (size_t i = 0; i < reason.size(); ++i) {
    const bool digit = std::isdigit(static_cast<unsigned char>(reason[i])) != 0;
    const bool inside_number = !text.empty() && text.back() == '#';
    const bool point = reason[i] == '.' && inside_number && i + 1 < reason.size() &&
                       std::isdigit(static_cast<unsigned char>(reason[i + 1])) != 0;
    if (!digit && !point) {
      text += reason[i];
    } else if (!inside_number) {
      text += '#';
    }
  }
  return text;
}

struct ConstraintCounts {
  int accepted_intra = 0;
  int accepted_inter = 0;
  std::map<std::string, int> refused;  // by reason
  int num_refused = 0;
};

ConstraintCounts CountConstraints(const CapturedSession& session) {
  ConstraintCounts counts;
  for (const auto& [id, constraint] : session.constraints) {
    if (!constraint.accepted) {
      ++counts.num_refused;
      ++counts.refused[WithoutFigures(constraint.reason)];
    } else if (constraint.kind == PlaceKind::kIntra) {
      ++counts.accepted_intra;
    } else {
      ++counts.accepted_inter;
    }
  }
  return counts;
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

ordered_json LinkJson(const AgentRun& run) {
  if (!run.link) {
    return {};
  }
  return {{"conditions", run.link->conditions},
          {"packets_up", run.link->packets_up},
          {"packets_down", run.link->packets_down}};
}

ordered_json AgentJson(const AgentFigures& agent) {
  const AgentRun& run = agent.run;
  return {{"id", agent.id},
          {"map_ids", MapIds(agent.maps)},
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

ordered_json JointJson(const GroupFigures& group) {
  return group.joint ? Number(group.joint->position_m.rmse) : ordered_json();
}

// Time in an agent's recording, since its first pose.
double RecordingSeconds(const ReportFigures& figures, int32_t agent_id, int64_t utime) {
  for (const AgentFigures& agent : figures.agents) {
    std::optional<int64_t> first;
    for (const auto& [map, odometry] : agent.odometry) {
      if (agent.id == agent_id && !odometry.empty()) {
        first = std::min(first.value_or(odometry.front().utime), odometry.front().utime);
      }
    }
    if (first) {
      return 1e-6 * static_cast<double>(utime - *first) + agent.initialised_s.value_or(0);
    }
  }
  return 0;
}

ordered_json ChangeJson(const GroupChange& change, const ReportFigures& figures) {
  ordered_json json = {{"change", change.fused ? "fused" : "taken apart"},
                       {"session_s", Number(change.session_s)}};
  json["agents"] = FinalGroup{{}, change.maps, {}, 0}.Agents();
  json["map_ids"] = MapIds(change.maps);
  json["recording_s"] = ordered_json::object();
  for (const auto& [agent, utime] : change.newest_utime) {
    json["recording_s"][fmt::format("{}", agent)] = Number(RecordingSeconds(figures, agent, utime));
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

std::string AgentTable(const ReportFigures& figures) {
  Table table({"agent", "maps", "keyframes", "initialised s", "path m", "ATE VIO m", "ATE server m",
               "coverage", "counts", "up kB/s", "down kB", "realtime"});
  for (const AgentFigures& agent : figures.agents) {
    const AgentRun& run = agent.run;
    table.Add(
        {fmt::format("{}", agent.id), fmt::format("{}", agent.maps.size()),
         fmt::format("{}", agent.keyframes), Cell(agent.initialised_s, 2),
         fmt::format("{:.1f}", agent.path_m), Cell(agent.vio), Cell(agent.server),
         Cell(agent.coverage, 2), agent.AteCounts() ? "yes" : "no",
         Cell(KilobytesPerSecondUp(agent), 1),
         run.bytes_down ? fmt::format("{:.1f}", 1e-3 * static_cast<double>(*run.bytes_down)) : "-",
         Cell(run.realtime_factor, 2)});
  }
  return table.Text();
}

std::string GroupTable(const ReportFigures& figures) {
  Table table({"group", "agents", "keyframes", "joint ATE m", "switched off", "maps"});
  for (size_t i = 0; i < figures.groups.size(); ++i) {
    const GroupFigures& group = figures.groups[i];
    table.Add({fmt::format("{}", i + 1), fmt::format("{}", fmt::join(group.group.Agents(), ", ")),
               fmt::format("{}", group.group.keyframes.size()),
               group.joint ? fmt::format("{:.3f}", group.joint->position_m.rmse) : "-",
               fmt::format("{}", group.group.num_switched_off), Joined(group.group.maps)});
  }
  return table.Text();
}

std::string ChangesText(const CapturedSession& session, const ReportFigures& figures) {
  std::string text;
  for (const GroupChange& change : session.changes) {
    std::string times;
    for (const auto& [agent, utime] : change.newest_utime) {
      times += fmt::format("{}agent {} at {:.1f} s of its recording", times.empty() ? "" : ", ",
                           agent, RecordingSeconds(figures, agent, utime));
    }
    text += fmt::format("- {:.1f} s: {} {} ({})\n", change.session_s,
                        change.fused ? "fused into one group:" : "taken apart, leaving",
                        Joined(change.maps), times);
  }
  return text.empty() ? std::string("No maps were fused.\n") : text;
}

std::string ConstraintsText(const CapturedSession& session) {
  const ConstraintCounts counts = CountConstraints(session);
  std::string text = fmt::format("{} accepted ({} by fusion, {} by inter_map_ba), {} refused.\n",
                                 counts.accepted_inter + counts.accepted_intra,
                                 counts.accepted_inter, counts.accepted_intra, counts.num_refused);
  if (!counts.refused.empty()) {
    Table table({"refused", "reason"});
    for (const auto& [reason, count] : counts.refused) {
      table.Add({fmt::format("{}", count), reason});
    }
    text += fmt::format("\n{}", table.Text());
  }
  return text;
}

// Empty when no constraint has ground truth.
std::string TruthText(const ReportFigures& figures) {
  if (figures.all_constraints.checked == 0) {
    return {};
  }
  Table table({"against ground truth", "checked", "wrong", "NEES / dim", "median", "> 99 %",
               "position", "yaw", "error median m", "p95 m"});
  const auto add = [&table](const char* name, const ConstraintsTruth& truth) {
    if (truth.checked > 0) {
      table.Add({name, fmt::format("{}", truth.checked), fmt::format("{}", truth.wrong),
                 fmt::format("{:.2f}", truth.pose.mean), fmt::format("{:.2f}", truth.pose.median),
                 fmt::format("{:.1f} %", 100 * truth.pose.share_above_99),
                 fmt::format("{:.2f}", truth.position.mean), fmt::format("{:.2f}", truth.yaw.mean),
                 fmt::format("{:.3f}", truth.translation_median_m),
                 fmt::format("{:.3f}", truth.translation_p95_m)});
    }
  };
  add("all", figures.all_constraints);
  add("between maps", figures.inter_constraints);
  add("within one", figures.intra_constraints);
  return fmt::format(
      "\n{}\nNEES: squared error / covariance, per dimension; 1 when the covariance is honest.\n",
      table.Text());
}

// Empty when the session made no link bad.
std::string LinksText(const ReportFigures& figures) {
  Table table({"agent", "link", "packets up", "delivered", "packets down", "delivered"});
  bool any = false;
  for (const AgentFigures& agent : figures.agents) {
    if (const auto& link = agent.run.link) {
      any = true;
      const auto cell = [](const std::map<std::string, int64_t>& packets, const char* name) {
        const auto count = packets.find(name);
        return count == packets.end() ? std::string("-") : fmt::format("{}", count->second);
      };
      table.Add({fmt::format("{}", agent.id), link->conditions, cell(link->packets_up, "taken"),
                 cell(link->packets_up, "delivered"), cell(link->packets_down, "taken"),
                 cell(link->packets_down, "delivered")});
    }
  }
  return any ? fmt::format("\n{}\nDelivered counts doubled packets twice.\n", table.Text())
             : std::string();
}

// Empty when no agent's poses were captured.
std::string LiveText(const ReportFigures& figures) {
  Table table({"agent", "live ATE m", "raw ATE m", "largest jump m"});
  bool any = false;
  for (const AgentFigures& agent : figures.agents) {
    any |= agent.live.jump_max_m.has_value();
    table.Add({fmt::format("{}", agent.id), Cell(agent.live.ate_m, 3),
               Cell(agent.live.ate_raw_m, 3), Cell(agent.live.jump_max_m, 3)});
  }
  return any ? fmt::format(
                   "\nWhat each agent showed while the session ran, from its first fusion "
                   "on:\n\n{}",
                   table.Text())
             : std::string();
}

std::string ProcessTable(const ReportInput& input, const CapturedSession& session) {
  Table table({"process", "realtime", "in", "out", "dropped", "median ms", "p99 ms", "MB", "CPU s",
               "restarts"});
  const ordered_json processes = ProcessesJson(input, session);
  const auto cell = [](const ordered_json& process, const char* key, int decimals) {
    return process.contains(key) ? fmt::format("{:.{}f}", process[key].get<double>(), decimals)
                                 : std::string("-");
  };
  for (const auto& [name, process] : processes.items()) {
    table.Add({name, cell(process, "realtime_factor", 2), cell(process, "messages_in", 0),
               cell(process, "messages_out", 0), cell(process, "dropped", 0),
               cell(process, "handling_median_ms", 2), cell(process, "handling_p99_ms", 2),
               cell(process, "memory_mb", 0), cell(process, "cpu_s", 1),
               cell(process, "restarts", 0)});
  }
  return table.Text();
}

}  // namespace

std::string FileName(const MapId& map) {
  return fmt::format("{}_{}", map.agent_id, map.opened_utime);
}

std::string ReportJson(const ReportInput& input, const CapturedSession& session,
                       const ReportFigures& figures) {
  ordered_json json;
  json["agents"] = ordered_json::array();
  for (const AgentFigures& agent : figures.agents) {
    json["agents"].push_back(AgentJson(agent));
  }
  json["groups"] = ordered_json::array();
  for (const GroupFigures& group : figures.groups) {
    json["groups"].push_back({{"agents", group.group.Agents()},
                              {"map_ids", MapIds(group.group.maps)},
                              {"keyframes", group.group.keyframes.size()},
                              {"constraints_switched_off", group.group.num_switched_off},
                              {"ate_joint_m", JointJson(group)}});
  }
  // The first group has most agents.
  json["ate_joint_m"] = figures.groups.empty() ? ordered_json() : JointJson(figures.groups.front());
  const ConstraintCounts counts = CountConstraints(session);
  json["constraints"] = {{"accepted", counts.accepted_inter + counts.accepted_intra},
                         {"accepted_inter", counts.accepted_inter},
                         {"accepted_intra", counts.accepted_intra},
                         {"refused", counts.num_refused},
                         {"refused_by_reason", counts.refused}};
  json["constraints_truth"] = TruthJson(figures.all_constraints);
  json["constraints_truth"]["inter"] = TruthJson(figures.inter_constraints);
  json["constraints_truth"]["intra"] = TruthJson(figures.intra_constraints);
  json["fused_at"] = ordered_json::array();
  for (const GroupChange& change : session.changes) {
    json["fused_at"].push_back(ChangeJson(change, figures));
  }
  json["processes"] = ProcessesJson(input, session);
  json["notes"] = figures.notes;
  return json.dump(2, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

std::string ReportMarkdown(const ReportInput& input, const CapturedSession& session,
                           const ReportFigures& figures) {
  std::string text = fmt::format(
      "# Session report\n\n{}\nATE: RMSE of positions after SE(3) alignment without scale; it "
      "counts "
      "with coverage of at least 0.95 and one map.\n",
      AgentTable(figures));
  text += LinksText(figures);
  text += LiveText(figures);
  text +=
      fmt::format("\n## Groups\n\n{}\nJoint ATE: one alignment for all agents of the group.\n\n{}",
                  GroupTable(figures), ChangesText(session, figures));
  text += fmt::format("\n## Constraints\n\n{}", ConstraintsText(session));
  text += TruthText(figures);
  if (!session.statuses.empty() || !input.realtime_factors.empty() || !input.restarts.empty()) {
    text += fmt::format("\n## Processes\n\n{}", ProcessTable(input, session));
  }
  if (!figures.notes.empty()) {
    text += fmt::format("\n## Notes\n\n- {}\n", fmt::join(figures.notes, "\n- "));
  }
  return text;
}

}  // namespace pangea::session
