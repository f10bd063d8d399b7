#include "session/report.h"

#include <fmt/format.h>

#include <fstream>
#include <stdexcept>

#include "session/report_html.h"
#include "session/report_pictures.h"
#include "session/report_text.h"

namespace pangea::session {
namespace {

void WriteText(const std::string& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.close();
  if (!file) {
    throw std::runtime_error(fmt::format("{}: cannot be written", path));
  }
}

void WriteTrajectories(const AgentFigures& agent, const std::vector<GroupFigures>& groups,
                       const std::string& folder) {
  const std::string prefix = fmt::format("{}/agent_{}", folder, agent.id);
  for (const auto& [map, odometry] : agent.odometry) {
    if (map != agent.main_map) {
      WriteTum(fmt::format("{}.{}.vio.tum", prefix, FileName(map)), odometry);
    }
  }
  const auto main = agent.odometry.find(agent.main_map);
  WriteTum(prefix + ".vio.tum", main == agent.odometry.end() ? Trajectory() : main->second);
  WriteTum(prefix + ".tum",
           groups.empty() ? Trajectory() : groups[agent.group].group.TrajectoryOf(agent.id));
  for (size_t i = 0; i < groups.size(); ++i) {
    for (const MapId& map : groups[i].group.maps) {
      if (i != agent.group && map.agent_id == agent.id) {
        WriteTum(fmt::format("{}.{}.tum", prefix, FileName(map)),
                 groups[i].group.TrajectoryOf(map));
      }
    }
  }
}

}  // namespace

std::string WriteReport(const ReportInput& input, const std::string& folder) {
  const CapturedSession session = ReadServerLog(input.server_log);
  ReportFigures figures = ComputeFigures(input, session);
  for (const AgentFigures& agent : figures.agents) {
    WriteTrajectories(agent, figures.groups, folder);
  }
  WriteText(folder + "/map.ply",
            MapPly(session, figures,
                   figures.groups.empty() ? FinalGroup() : figures.groups.front().group));
  for (size_t i = 1; i < figures.groups.size(); ++i) {
    const FinalGroup& group = figures.groups[i].group;
    WriteText(fmt::format("{}/map.{}.ply", folder, FileName(group.frame)),
              MapPly(session, figures, group));
  }
  try {
    for (const Picture& picture : Pictures(figures)) {
      WritePng(picture.plot, folder + "/" + picture.file);
    }
  } catch (const std::runtime_error& error) {
    figures.notes.emplace_back(error.what());
  }
  WriteText(folder + "/report.json", ReportJson(input, session, figures));
  std::string markdown = ReportMarkdown(input, session, figures);
  WriteText(folder + "/report.md", markdown);
  WriteText(folder + "/report.html", ReportHtml(input, session, figures));
  return markdown;
}

}  // namespace pangea::session
