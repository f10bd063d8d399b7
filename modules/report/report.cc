#include "report/report.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>

#include "files/text_file.h"
#include "report/earlier_report.h"
#include "report/html/report_html.h"
#include "report/report_anchor_pictures.h"
#include "report/report_files.h"
#include "report/report_json.h"
#include "report/report_pictures.h"
#include "report/report_text.h"

namespace pangea {
namespace {

using nlohmann::ordered_json;

void WriteTrajectories(const AgentMetrics& agent, const std::vector<GroupMetrics>& groups,
                       const std::string& folder) {
  const auto write = [&folder](const std::string& file, const Trajectory& trajectory) {
    WriteTum(folder + "/" + file, trajectory);
  };
  for (const auto& [map, odometry] : agent.odometry) {
    if (map != agent.main_map) {
      write(OdometryFile(agent.id, map), odometry);
    }
  }
  const auto main = agent.odometry.find(agent.main_map);
  write(OdometryFile(agent.id), main == agent.odometry.end() ? Trajectory() : main->second);
  write(TrajectoryFile(agent.id),
        groups.empty() ? Trajectory()
                       : groups[agent.group].group.TrajectoryOf(agent.trajectory_maps));
  for (const GroupMetrics& metrics : groups) {
    for (const MapId& map : metrics.group.maps) {
      if (map.agent_id == agent.id && agent.trajectory_maps != std::set<MapId>{map}) {
        write(TrajectoryFile(agent.id, map), metrics.group.TrajectoryOf({map}));
      }
    }
  }
}

}  // namespace

WrittenReport WriteReport(const ReportInput& input, const std::string& folder,
                          LogReadings* readings) {
  const CapturedSession session = ReadServerLog(input.server_log, readings);
  ReportMetrics metrics = ComputeMetrics(input, session, readings);
  RemoveEarlierReport(folder);
  for (const AgentMetrics& agent : metrics.agents) {
    WriteTrajectories(agent, metrics.groups, folder);
  }
  WriteTextFile(folder + "/" + PlyFile(),
                MapPly(session, metrics,
                       metrics.groups.empty() ? FinalGroup() : metrics.groups.front().group));
  for (size_t i = 1; i < metrics.groups.size(); ++i) {
    const FinalGroup& group = metrics.groups[i].group;
    WriteTextFile(folder + "/" + PlyFile(group.frame), MapPly(session, metrics, group));
  }
  try {
    for (const Picture& picture : Pictures(metrics)) {
      WritePng(picture.plot, folder + "/" + picture.file);
    }
  } catch (const std::runtime_error& error) {
    metrics.notes.emplace_back(error.what());
  }
  const std::string anchors_jpeg = AnchorsJpeg(session, metrics, &metrics.notes);
  if (!anchors_jpeg.empty()) {
    WriteTextFile(folder + "/" + kAnchorPicture, anchors_jpeg);
  }
  ordered_json json = ReportJson(input, session, metrics);
  std::string markdown = ReportMarkdown(input, session, metrics, !anchors_jpeg.empty());
  std::string html = ReportHtml(input, session, metrics, anchors_jpeg);
  std::vector<CheckedExpectation> checked = Check(input.expect, json);
  if (!checked.empty()) {
    const Table table = ToTable(checked);
    json["expectations"] = ToJson(checked);
    markdown += fmt::format("\n## Expectations\n\n{}", table.Text());
    html = WithSection(std::move(html), "expectations", "Expectations", table);
  }
  // Texts in a log may contain any bytes.
  WriteTextFile(folder + "/report.json",
                json.dump(2, ' ', false, ordered_json::error_handler_t::replace) + "\n");
  WriteTextFile(folder + "/report.md", markdown);
  WriteTextFile(folder + "/report.html", html);
  std::vector<AgentRun> runs;
  for (AgentMetrics& agent : metrics.agents) {
    runs.push_back(std::move(agent.run));
  }
  return {std::move(markdown), std::move(runs), std::move(checked)};
}

}  // namespace pangea
