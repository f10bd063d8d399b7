#include "report/report_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "report/metrics/report_counts.h"

namespace pangea {
namespace {

std::string Cell(const std::optional<double>& value, int decimals) {
  return value ? fmt::format("{:.{}f}", *value, decimals) : "-";
}
std::string Cell(const std::optional<Ate>& ate) {
  return ate ? fmt::format("{:.3f}", ate->position_m.rmse) : "-";
}
std::string Kilobytes(const std::optional<int64_t>& bytes) {
  return bytes ? fmt::format("{:.1f}", 1e-3 * static_cast<double>(*bytes)) : "-";
}

std::string Joined(const std::vector<MapId>& maps) {
  std::string text;
  for (const MapId& map : maps) {
    text += fmt::format("{}{}", text.empty() ? "" : ", ", ToString(map));
  }
  return text;
}

void AddTruth(const char* name, const ConstraintsTruth& truth, Table* table) {
  if (truth.checked > 0) {
    table->Add({name, fmt::format("{}", truth.checked), fmt::format("{}", truth.wrong),
                fmt::format("{:.2f}", truth.pose.mean), fmt::format("{:.2f}", truth.pose.median),
                fmt::format("{:.1f} %", 100 * truth.pose.share_above_99),
                fmt::format("{:.2f}", truth.position.mean), fmt::format("{:.2f}", truth.yaw.mean),
                fmt::format("{:.3f}", truth.translation_median_m),
                fmt::format("{:.3f}", truth.translation_p95_m)});
  }
}

}  // namespace

Table AgentTable(const ReportMetrics& metrics) {
  Table table({"agent", "maps", "keyframes", "initialised s", "path m", "ATE VIO m", "ATE server m",
               "coverage", "ATE valid", "up kB/s", "down kB", "realtime"});
  for (const AgentMetrics& agent : metrics.agents) {
    const AgentRun& run = agent.run;
    table.Add({fmt::format("{}", agent.id), fmt::format("{}", agent.maps.size()),
               fmt::format("{}", agent.keyframes), Cell(agent.initialised_s, 2),
               fmt::format("{:.1f}", agent.path_m), Cell(agent.vio), Cell(agent.server),
               Cell(agent.coverage, 2), agent.AteCounts() ? "yes" : "no",
               Cell(KilobytesPerSecondUp(agent), 1), Kilobytes(run.bytes_down),
               Cell(run.realtime_factor, 2)});
  }
  return table;
}

Table GroupTable(const ReportMetrics& metrics) {
  Table table({"group", "agents", "keyframes", "joint ATE m", "switched off", "maps"});
  for (size_t i = 0; i < metrics.groups.size(); ++i) {
    const GroupMetrics& group = metrics.groups[i];
    table.Add({fmt::format("{}", i + 1), fmt::format("{}", fmt::join(group.group.Agents(), ", ")),
               fmt::format("{}", group.group.keyframes.size()),
               group.joint ? fmt::format("{:.3f}", group.joint->position_m.rmse) : "-",
               fmt::format("{}", group.group.num_switched_off), Joined(group.group.maps)});
  }
  return table;
}

Table LiveTable(const ReportMetrics& metrics) {
  Table table({"agent", "live ATE m", "raw ATE m", "largest jump m"});
  const bool any = std::ranges::any_of(
      metrics.agents, [](const AgentMetrics& a) { return a.live.jump_max_m.has_value(); });
  for (size_t i = 0; any && i < metrics.agents.size(); ++i) {
    const AgentMetrics& agent = metrics.agents[i];
    table.Add({fmt::format("{}", agent.id), Cell(agent.live.ate_m, 3),
               Cell(agent.live.ate_raw_m, 3), Cell(agent.live.jump_max_m, 3)});
  }
  return table;
}

Table LinksTable(const ReportMetrics& metrics) {
  Table table({"agent", "link", "packets up", "delivered", "packets down", "delivered"});
  const auto cell = [](const std::map<std::string, int64_t>& packets, const char* name) {
    const auto count = packets.find(name);
    return count == packets.end() ? std::string("-") : fmt::format("{}", count->second);
  };
  for (const AgentMetrics& agent : metrics.agents) {
    if (const auto& link = agent.run.link) {
      table.Add({fmt::format("{}", agent.id), link->conditions, cell(link->packets_up, "taken"),
                 cell(link->packets_up, "delivered"), cell(link->packets_down, "taken"),
                 cell(link->packets_down, "delivered")});
    }
  }
  return table;
}

Table RefusedTable(const CapturedSession& session) {
  Table table({"refused", "reason"});
  for (const auto& [reason, count] : CountConstraints(session).refused) {
    table.Add({fmt::format("{}", count), reason});
  }
  return table;
}

Table TruthTable(const ReportMetrics& metrics) {
  Table table({"against ground truth", "checked", "wrong", "NEES / dim", "median", "> 99 %",
               "position", "yaw", "error median m", "p95 m"});
  AddTruth("all", metrics.all_constraints, &table);
  AddTruth("between maps", metrics.inter_constraints, &table);
  AddTruth("within one", metrics.intra_constraints, &table);
  return table;
}

Table AnchorTable(const ReportMetrics& metrics) {
  Table table({"anchor", "made by", "agent", "error m", "px", "largest jump m", "at fusion m",
               "after 10 s m", "end m", "max m", "unblended m", ""});
  for (const AnchorMetrics& anchor : metrics.anchors) {
    std::vector<std::string> cells = {anchor.name, fmt::format("{}", anchor.made_by)};
    if (anchor.agents.empty()) {
      cells.resize(11, "-");
      cells.emplace_back(anchor.placed ? "no other agent is in its group" : "never placed");
      table.Add(std::move(cells));
      continue;
    }
    for (const AnchorAtAgent& at : anchor.agents) {
      std::string reason = anchor.placed ? at.reason : "never placed";
      table.Add({cells[0], cells[1], fmt::format("{}", at.agent), Cell(at.error_m, 3),
                 Cell(at.error_px, 1), Cell(at.largest_jump_m, 3), Cell(at.error_at_fusion_m, 3),
                 Cell(at.error_10s_m, 3), Cell(at.error_end_m, 3), Cell(at.error_max_m, 3),
                 Cell(at.error_unblended_m, 3), std::move(reason)});
    }
  }
  return table;
}

Table ProcessTable(const ReportInput& input, const CapturedSession& session) {
  Table table({"process", "realtime", "in", "out", "dropped", "median ms", "p99 ms", "MB", "CPU s",
               "restarts"});
  std::set<std::string> names;
  for (const auto& [name, status] : session.statuses) {
    names.insert(name);
  }
  for (const auto& [name, factor] : input.realtime_factors) {
    names.insert(name);
  }
  for (const auto& [name, count] : input.restarts) {
    names.insert(name);
  }
  for (const std::string& name : names) {
    const auto factor = input.realtime_factors.find(name);
    const auto restarts = input.restarts.find(name);
    const auto status = session.statuses.find(name);
    std::vector<std::string> cells = {
        name, factor == input.realtime_factors.end() ? "-" : fmt::format("{:.2f}", factor->second)};
    if (status == session.statuses.end()) {
      cells.resize(cells.size() + 7, "-");
    } else {
      const status_t& said = status->second;
      for (const int64_t count : {said.messages_in, said.messages_out, said.dropped}) {
        cells.push_back(fmt::format("{}", count));
      }
      cells.push_back(fmt::format("{:.2f}", said.handling_median_ms));
      cells.push_back(fmt::format("{:.2f}", said.handling_p99_ms));
      cells.push_back(fmt::format("{:.0f}", said.memory_mb));
      cells.push_back(fmt::format("{:.1f}", said.cpu_s));
    }
    cells.push_back(restarts == input.restarts.end() ? "-" : fmt::format("{}", restarts->second));
    table.Add(std::move(cells));
  }
  return table;
}

Table TrafficTable(const ReportMetrics& metrics) {
  Table table({"agent", "sent kB", "kB/s on average", "received kB"});
  for (const AgentMetrics& agent : metrics.agents) {
    if (agent.run.bytes_up) {
      table.Add({fmt::format("{}", agent.id), Kilobytes(agent.run.bytes_up),
                 Cell(KilobytesPerSecondUp(agent), 1), Kilobytes(agent.run.bytes_down)});
    }
  }
  if (!table.empty()) {  // Fig. 4 and section V.B: 95.4 MB and 23.6 kB in 119 s
    table.Add({"the paper's (Fig. 4)", "95400", "801.7", "23.6"});
  }
  return table;
}

std::vector<std::string> ChangeLines(const CapturedSession& session, const ReportMetrics& metrics) {
  std::vector<std::string> lines;
  for (const GroupChange& change : session.changes) {
    std::string times;
    for (const auto& [agent, seconds] : RecordingSeconds(metrics, change)) {
      times += fmt::format("{}agent {} at {:.1f} s of its recording", times.empty() ? "" : ", ",
                           agent, seconds);
    }
    lines.push_back(fmt::format("{:.1f} s: {} {} ({})", change.session_s,
                                change.fused ? "fused into one group:" : "taken apart, leaving",
                                Joined(change.maps), times));
  }
  return lines;
}

std::string NoChangeLine(const CapturedSession& session) {
  return LacksStates(session) ? "Fusions are unknown: see the notes." : "No maps were fused.";
}

std::string ConstraintsLine(const CapturedSession& session) {
  const ConstraintCounts counts = CountConstraints(session);
  const std::string derived =
      counts.accepted_derived > 0 ? fmt::format(", {} by thinning", counts.accepted_derived) : "";
  return fmt::format("{} accepted ({} by fusion, {} by inter_map_ba{}), {} refused.",
                     counts.num_accepted(), counts.accepted_inter, counts.accepted_intra, derived,
                     counts.num_refused);
}

}  // namespace pangea
