#include "report/metrics/report_paper.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <string_view>

namespace pangea {
namespace {

// bench/accuracy_test.py checks that these values equal those in bench/accuracy_lib/anchors.py.
//
// Table II, ATE in metres: VINS-Mobile2 alone and with the server (the better phone of the two),
// VINS-Mono. Table III: the second half fused into the first, the first into the second, and one
// agent over the whole sequence.
struct PaperSequence {
  std::string_view name;
  double alone, server, vins_mono;
  double first_second, second_first, whole;
};
constexpr std::array<PaperSequence, 5> kSequences = {{
    {"MH_01", 0.061, 0.050, 0.082, 0.071, 0.046, 0.053},
    {"MH_02", 0.086, 0.073, 0.073, 0.080, 0.070, 0.080},
    {"MH_03", 0.109, 0.054, 0.057, 0.067, 0.102, 0.054},
    {"MH_04", 0.166, 0.163, 0.148, 0.198, 0.190, 0.166},
    {"MH_05", 0.087, 0.093, 0.107, 0.159, 0.090, 0.096},
}};

// Table IV, for the second agent: fused with the first, alone with the server, and VINS-Mono's
// multi-session mode.
struct PaperPair {
  std::string_view first, second;
  double fused, alone, vins_mono;
};
constexpr std::array<PaperPair, 7> kPairs = {{
    {"MH_03", "MH_01", 0.044, 0.053, 0.047},
    {"MH_01", "MH_02", 0.049, 0.080, 0.049},
    {"MH_04", "MH_05", 0.090, 0.095, 0.106},
    {"MH_01", "MH_05", 0.092, 0.095, 0.117},
    {"MH_02", "MH_03", 0.069, 0.054, 0.059},
    {"MH_03", "MH_04", 0.127, 0.166, 0.116},
    {"MH_05", "MH_04", 0.120, 0.166, 0.096},
}};

struct PlayedSequence {
  const AgentMetrics* agent;
  const PaperSequence* paper;
  bool whole;
};

std::vector<PlayedSequence> PlayedSequences(const ReportMetrics& metrics) {
  std::vector<PlayedSequence> played;
  for (const AgentMetrics& agent : metrics.agents) {
    const auto name = SequenceOf(agent.run.recording);
    if (name && agent.server) {
      const auto* const paper = std::ranges::find(kSequences, *name, &PaperSequence::name);
      played.push_back({&agent, paper, agent.run.start_s == 0 && !agent.run.duration_s});
    }
  }
  return played;
}

std::string Metres(double value) { return fmt::format("{:.3f}", value); }
std::string Metres(const std::optional<Ate>& ate) {
  return ate ? Metres(ate->position_m.rmse) : "-";
}

bool Fused(const ReportMetrics& metrics, const AgentMetrics& a, const AgentMetrics& b) {
  return a.group == b.group && metrics.groups[a.group].group.CountOf(a.id) > 0 &&
         metrics.groups[a.group].group.CountOf(b.id) > 0;
}

PaperTable SingleAgents(const std::vector<PlayedSequence>& played) {
  PaperTable single{"Table II: each agent, ATE m",
                    Table({"recording", "odometry alone", "with the server", "paper: alone",
                           "paper: with the server", "VINS-Mono"})};
  for (const auto& [agent, paper, whole] : played) {
    if (whole) {
      single.table.Add({std::string(paper->name), Metres(agent->vio), Metres(agent->server),
                        Metres(paper->alone), Metres(paper->server), Metres(paper->vins_mono)});
    }
  }
  return single;
}

PaperTable Halves(const ReportMetrics& metrics, const std::vector<PlayedSequence>& played) {
  PaperTable halves{"Table III: two parts of one recording as two agents, joint ATE m",
                    Table({"recording", "fused", "paper: 1st-2nd", "paper: 2nd-1st",
                           "paper: one agent, all of it"})};
  for (size_t i = 0; i + 1 < played.size(); ++i) {
    const auto& [agent, paper, whole] = played[i];
    const auto& other = played[i + 1];
    const auto& joint = metrics.groups[agent->group].joint;
    if (paper == other.paper && !whole && !other.whole && joint &&
        Fused(metrics, *agent, *other.agent)) {
      halves.table.Add({std::string(paper->name), Metres(joint->position_m.rmse),
                        Metres(paper->first_second), Metres(paper->second_first),
                        Metres(paper->whole)});
    }
  }
  return halves;
}

PaperTable TwoAgents(const ReportMetrics& metrics, const std::vector<PlayedSequence>& played) {
  PaperTable pairs{"Table IV: the second of two agents, ATE m",
                   Table({"first", "second", "fused", "paper: fused",
                          "paper: alone with the server", "VINS-Mono multi-session"})};
  for (const PaperPair& pair : kPairs) {
    for (const PlayedSequence& first : played) {
      for (const PlayedSequence& second : played) {
        if (first.paper->name == pair.first && second.paper->name == pair.second && first.whole &&
            second.whole && Fused(metrics, *first.agent, *second.agent)) {
          pairs.table.Add({std::string(pair.first), std::string(pair.second),
                           Metres(second.agent->server), Metres(pair.fused), Metres(pair.alone),
                           Metres(pair.vins_mono)});
        }
      }
    }
  }
  return pairs;
}

}  // namespace

std::optional<std::string> SequenceOf(const std::string& recording) {
  std::filesystem::path folder = std::filesystem::path(recording).lexically_normal();
  while (!folder.has_filename() || folder.filename() == "mav0") {
    if (!folder.has_relative_path()) {
      return std::nullopt;
    }
    folder = folder.parent_path();
  }
  const std::string name = folder.filename().string().substr(0, 5);
  const bool known = std::ranges::find(kSequences, name, &PaperSequence::name) != kSequences.end();
  return known ? std::optional(name) : std::nullopt;
}

std::vector<PaperTable> PaperTables(const ReportMetrics& metrics) {
  const std::vector<PlayedSequence> played = PlayedSequences(metrics);
  std::vector<PaperTable> tables = {SingleAgents(played), Halves(metrics, played),
                                    TwoAgents(metrics, played)};
  std::erase_if(tables, [](const PaperTable& table) { return table.table.empty(); });
  return tables;
}

}  // namespace pangea
