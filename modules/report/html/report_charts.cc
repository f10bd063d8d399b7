#include "report/html/report_charts.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <map>

namespace pangea {
namespace {

constexpr int kChartHeight = 480;
constexpr size_t kNumColours = 7;  // number of different colours of AgentColour

Plot Chart(const std::string& title, const std::string& y_label) {
  return {.title = title,
          .x_label = "session [s]",
          .y_label = y_label,
          .y_from_zero = true,
          .height = kChartHeight};
}

double SessionSeconds(const CapturedSession& session, int64_t utime) {
  return 1e-6 * static_cast<double>(utime - session.begin_utime);
}

// Growth per second of a count that a process publishes once a second. A restarted process counts
// from zero: the line breaks there.
std::vector<Eigen::Vector2d> Rate(const CapturedSession& session,
                                  const std::vector<ProcessSample>& samples,
                                  const std::function<double(const ProcessSample&)>& count) {
  std::vector<Eigen::Vector2d> points;
  for (size_t i = 1; i < samples.size(); ++i) {
    const double seconds = 1e-6 * static_cast<double>(samples[i].utime - samples[i - 1].utime);
    const double grown = count(samples[i]) - count(samples[i - 1]);
    points.push_back(
        grown < 0 || seconds <= 0
            ? kPlotBreak
            : Eigen::Vector2d(SessionSeconds(session, samples[i].utime), grown / seconds));
  }
  return points;
}

void AddLoad(const CapturedSession& session, const ProcessSamples& processes, Plot* plot) {
  for (const auto& [name, samples] : processes) {
    const size_t index = plot->lines.size();
    plot->lines.push_back({.label = name,
                           .colour = AgentColour(index),
                           .dashed = index >= kNumColours,
                           .points = Rate(session, samples, [](const ProcessSample& sample) {
                             return 100 * sample.cpu_s;
                           })});
  }
}

// The bar of one map.
struct Bar {
  double y = 0;
  double from_s = 0;
  double to_s = 0;
  MapId frame;  // the map whose frame it is in
  std::string name = {};
};

void AddBar(const Bar& bar, double to_s, const ReportMetrics& metrics, Plot* plot) {
  plot->lines.push_back({.name = fmt::format("{}, {:.1f} to {:.1f} s: in agent {}'s map frame",
                                             bar.name, bar.from_s, to_s, bar.frame.agent_id),
                         .colour = AgentColour(metrics.IndexOf(bar.frame.agent_id)),
                         .width = 14,
                         .points = {{bar.from_s, bar.y}, {to_s, bar.y}}});
}

std::map<MapId, Bar> Bars(const CapturedSession& session) {
  std::map<MapId, Bar> bars;
  for (const auto& [id, keyframe] : session.keyframes) {
    const auto [bar, is_new] =
        bars.try_emplace(id.map, Bar{0, keyframe.session_s, keyframe.session_s, id.map});
    bar->second.from_s = std::min(bar->second.from_s, keyframe.session_s);
    bar->second.to_s = std::max(bar->second.to_s, keyframe.session_s);
  }
  auto y = static_cast<double>(bars.size());  // the first one on top
  for (auto& [map, bar] : bars) {
    bar.y = y--;
  }
  return bars;
}

}  // namespace

Plot FusionChart(const CapturedSession& session, const ReportMetrics& metrics) {
  Plot plot = Chart("which maps were one", "");
  plot.y_from_zero = false;
  std::map<MapId, Bar> bars = Bars(session);
  std::map<int32_t, int> maps_of_agent;
  for (auto& [map, bar] : bars) {
    const int nth = ++maps_of_agent[map.agent_id];
    bar.name = nth == 1 ? fmt::format("agent {}", map.agent_id)
                        : fmt::format("agent {}, map {}", map.agent_id, nth);
    plot.y_names.push_back(bar.name);
  }
  std::ranges::reverse(plot.y_names);
  plot.height = std::min(300 + 40 * static_cast<int>(bars.size()), 1200);
  std::vector<PlotLine> joints;
  for (const GroupChange& change : session.changes) {
    const auto frame = bars.find(change.frame);
    for (const MapId& map : change.maps) {
      const auto bar = bars.find(map);
      if (bar == bars.end() || frame == bars.end() || bar->second.frame == change.frame) {
        continue;
      }
      AddBar(bar->second, change.session_s, metrics, &plot);
      bar->second.from_s = change.session_s;
      bar->second.to_s = std::max(bar->second.to_s, change.session_s);
      bar->second.frame = change.frame;
      joints.push_back(
          {.colour = "#555555",
           .width = 1.5,
           .points = {{change.session_s, bar->second.y}, {change.session_s, frame->second.y}}});
    }
  }
  for (const auto& [map, bar] : bars) {
    AddBar(bar, bar.to_s, metrics, &plot);
  }
  plot.lines.insert(plot.lines.end(), joints.begin(), joints.end());
  return plot;
}

Plot LoadChart(const CapturedSession& session, const ReportMetrics& metrics) {
  Plot plot = Chart("load of each process", "CPU [% of one core]");
  AddLoad(session, session.samples, &plot);
  for (const AgentMetrics& agent : metrics.agents) {
    AddLoad(session, agent.samples, &plot);
  }
  return plot;
}

Plot TrafficChart(const CapturedSession& session, const ReportMetrics& metrics) {
  Plot plot = Chart("bytes on the link, per second", "kB/s");
  for (size_t i = 0; i < metrics.agents.size(); ++i) {
    const AgentMetrics& agent = metrics.agents[i];
    const auto uplink = agent.samples.find(fmt::format("uplink_{}", agent.id));
    if (uplink == agent.samples.end()) {
      continue;
    }
    for (const bool up : {true, false}) {
      plot.lines.push_back(
          {.label = fmt::format("agent {} {}", agent.id, up ? "sends" : "receives"),
           .colour = AgentColour(i),
           .dashed = !up,
           .points = Rate(session, uplink->second, [up](const ProcessSample& sample) {
             return 1e-3 *
                    static_cast<double>((up ? sample.bytes_up : sample.bytes_down).value_or(0));
           })});
    }
  }
  return plot;
}

}  // namespace pangea
