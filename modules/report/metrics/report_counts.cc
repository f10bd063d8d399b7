#include "report/metrics/report_counts.h"

#include <algorithm>
#include <cctype>

namespace pangea {
namespace {

struct Span {
  int64_t begin = 0, end = 0;
};

// Time from the odometry's first pose in the recording to its last, sensor clock.
std::optional<Span> OdometrySpan(const AgentMetrics& agent) {
  std::optional<Span> span;
  for (const auto& [map, odometry] : agent.odometry) {
    if (!odometry.empty() && agent.recording_maps.contains(map)) {
      const Span of_map{odometry.front().utime, odometry.back().utime};
      span = span ? Span{std::min(span->begin, of_map.begin), std::max(span->end, of_map.end)}
                  : of_map;
    }
  }
  return span;
}

// Recording time played, to which the link's bytes are related.
std::optional<double> PlayedSeconds(const AgentMetrics& agent) {
  const Span span = OdometrySpan(agent).value_or(Span());
  const double seconds = 1e-6 * static_cast<double>(span.end - span.begin) +
                         std::max(0.0, agent.initialised_s.value_or(0));
  return seconds > 0 ? std::optional(seconds) : std::nullopt;
}

// Replaces numbers in a reason, so that equal reasons are counted together.
std::string WithoutNumbers(const std::string& reason) {
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

}  // namespace

ConstraintCounts CountConstraints(const CapturedSession& session) {
  ConstraintCounts counts;
  for (const auto& [id, constraint] : session.constraints) {
    if (!constraint.accepted) {
      ++counts.num_refused;
      ++counts.refused[WithoutNumbers(constraint.reason)];
    } else if (constraint.kind == PlaceKind::kIntra) {
      ++counts.accepted_intra;
    } else if (constraint.kind == PlaceKind::kDerived) {
      ++counts.accepted_derived;
    } else {
      ++counts.accepted_inter;
    }
  }
  return counts;
}

std::optional<double> KilobytesPerSecondUp(const AgentMetrics& agent) {
  const auto seconds = PlayedSeconds(agent);
  if (!seconds || !agent.run.bytes_up) {
    return std::nullopt;
  }
  return 1e-3 * static_cast<double>(*agent.run.bytes_up) / *seconds;
}

std::map<int32_t, double> RecordingSeconds(const ReportMetrics& metrics,
                                           const GroupChange& change) {
  std::map<int32_t, int64_t> newest;
  for (const auto& [map, utime] : change.newest_utime) {
    const size_t agent = metrics.IndexOf(map.agent_id);
    if (agent < metrics.agents.size() && metrics.agents[agent].recording_maps.contains(map)) {
      int64_t& of_agent = newest.try_emplace(map.agent_id, utime).first->second;
      of_agent = std::max(of_agent, utime);
    }
  }
  std::map<int32_t, double> seconds;
  for (const auto& [agent, utime] : newest) {
    seconds[agent] = RecordingSeconds(metrics, agent, utime);
  }
  return seconds;
}

double RecordingSeconds(const ReportMetrics& metrics, int32_t agent_id, int64_t utime) {
  for (const AgentMetrics& agent : metrics.agents) {
    if (const auto span = agent.id == agent_id ? OdometrySpan(agent) : std::nullopt) {
      return agent.run.start_s + agent.initialised_s.value_or(0) +
             1e-6 * static_cast<double>(utime - span->begin);
    }
  }
  return 0;
}

}  // namespace pangea
