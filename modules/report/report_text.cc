#include "report/report_text.h"

#include <fmt/format.h>

#include "report/report_anchor_pictures.h"
#include "report/report_files.h"
#include "report/report_tables.h"

namespace pangea {

std::string ReportMarkdown(const ReportInput& input, const CapturedSession& session,
                           const ReportMetrics& metrics, bool has_anchor_picture) {
  std::string text = "# Session report\n\n";
  if (!metrics.lost.empty()) {
    text += fmt::format("**{}**\n\n- {}\n\n", kLostExplained, fmt::join(metrics.lost, "\n- "));
  }
  text += fmt::format("{}\n{}\n", AgentTable(metrics).Text(), kAteExplained);
  if (const Table links = LinksTable(metrics); !links.empty()) {
    text += fmt::format("\n{}\nDelivered counts doubled packets twice.\n", links.Text());
  }
  if (const Table live = LiveTable(metrics); !live.empty()) {
    text += fmt::format(
        "\nWhat each agent showed while the session ran, from its first fusion on:\n\n{}",
        live.Text());
  }
  text +=
      fmt::format("\n## Groups\n\n{}\nJoint ATE: one alignment for all agents of the group.\n\n",
                  GroupTable(metrics).Text());
  const std::vector<std::string> changes = ChangeLines(session, metrics);
  text += changes.empty() ? NoChangeLine(session) + "\n"
                          : fmt::format("- {}\n", fmt::join(changes, "\n- "));
  text += fmt::format("\n## Constraints\n\n{}\n", ConstraintsLine(session));
  if (const Table refused = RefusedTable(session); !refused.empty()) {
    text += fmt::format("\n{}", refused.Text());
  }
  if (const Table truth = TruthTable(metrics); !truth.empty()) {
    text += fmt::format("\n{}\n{}\n", truth.Text(), kNeesExplained);
  }
  if (const Table anchors = AnchorTable(metrics); !anchors.empty()) {
    text += fmt::format("\n## Anchors\n\n{}\n{}\n", anchors.Text(), kAnchorsExplained);
    if (has_anchor_picture) {
      text += fmt::format("\n![Anchors]({})\n\n{}\n", kAnchorPicture, kAnchorPictureExplained);
    }
  }
  if (const Table processes = ProcessTable(input, session); !processes.empty()) {
    text += fmt::format("\n## Processes\n\n{}\n{}\n", processes.Text(), kProcessesExplained);
  }
  if (!metrics.notes.empty()) {
    text += fmt::format("\n## Notes\n\n- {}\n", fmt::join(metrics.notes, "\n- "));
  }
  return text;
}

}  // namespace pangea
