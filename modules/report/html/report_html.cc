#include "report/html/report_html.h"

#include <fmt/format.h>
#include <sodium.h>

#include "report/html/report_charts.h"
#include "report/html/report_svg.h"
#include "report/metrics/report_paper.h"
#include "report/report_anchor_pictures.h"
#include "report/report_pictures.h"
#include "report/report_tables.h"

namespace pangea {
namespace {

// The content security policy forbids all requests and every script except this one, identified by
// its hash, whatever the texts of a log contain.
constexpr const char* kPolicy = R"(<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8"/>
<meta name="viewport" content="width=device-width, initial-scale=1"/>
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'sha256-{}'"/>
)";

constexpr const char* kHead = R"(<title>Session report</title>
<style>
:root { color-scheme: light dark; --edge: #8884; --soft: #8881; --bright: 1; }
@media (prefers-color-scheme: dark) {
  :root { --bright: 1.5; }
  [style*="#000000"] { --line: #fff !important; }
}
body { font: 16px/1.5 system-ui, sans-serif; max-width: 72rem; margin: 0 auto; padding: 1rem; }
h1 { margin-bottom: 0.5rem; }
h2 { margin-top: 2.5rem; border-bottom: 1px solid var(--edge); }
.chart { position: relative; margin: 1rem 0; }
.chart figcaption { text-align: center; font-weight: bold; }
.chart svg { width: 100%; height: auto; touch-action: pan-y; }
.chart text { fill: currentColor; font-size: 14px; }
.grid { stroke: var(--edge); }
.line { fill: none; stroke: var(--line); stroke-linejoin: round; }
.line, .legend span, .marks circle, .tip i { filter: brightness(var(--bright)); }
.line circle { fill: var(--line); stroke: none; }
.line.dashed { stroke-dasharray: 6 4; }
.line.off { display: none; }
.marks circle { fill: var(--line); stroke: Canvas; }
.marks .rule { stroke: currentColor; stroke-dasharray: 2 3; }
.marks { pointer-events: none; }
.legend { display: flex; flex-wrap: wrap; justify-content: center; gap: 0.25rem; margin: 0.25rem 0; }
.legend button { font: inherit; font-size: 0.85rem; color: inherit; background: none; border: 1px solid transparent; border-radius: 6px; cursor: pointer; }
.legend button:hover { border-color: var(--edge); }
.legend button[aria-pressed="false"] { opacity: 0.4; text-decoration: line-through; }
.legend span { display: inline-block; width: 1.6rem; margin-right: 0.4rem; vertical-align: middle; border-top: 3px solid var(--line); }
.legend .dashed { border-top-style: dashed; }
.tip { position: absolute; z-index: 1; padding: 0.3rem 0.6rem; background: Canvas; border: 1px solid var(--edge); border-radius: 6px; box-shadow: 0 2px 8px #0004; font-size: 0.85rem; pointer-events: none; white-space: nowrap; }
.tip .row { display: flex; justify-content: space-between; gap: 1rem; }
.tip i { font-style: normal; border-left: 4px solid var(--line, transparent); padding-left: 0.4rem; }
.tip b { font-variant-numeric: tabular-nums; }
.wide { overflow-x: auto; }
img { max-width: 100%; }
table { border-collapse: collapse; margin: 0.75rem 0; font-size: 0.9rem; }
th, td { padding: 0.25rem 0.6rem; border-bottom: 1px solid var(--edge); text-align: left; }
th { background: var(--soft); }
td.n { text-align: right; font-variant-numeric: tabular-nums; }
.tiles { display: flex; flex-wrap: wrap; gap: 0.75rem; margin: 1rem 0; padding: 0; list-style: none; }
.tiles li { background: var(--soft); border: 1px solid var(--edge); border-radius: 6px; padding: 0.5rem 1rem; }
.tiles b { display: block; font-size: 1.4rem; }
.aside { opacity: 0.75; font-size: 0.9rem; }
@media (max-width: 40rem) {
  .chart text { font-size: 22px; }
  .tiles { gap: 0.5rem; }
  .tiles li { flex: 1 1 auto; }
}
@media print { body { max-width: none; } h2 { break-after: avoid; } .chart { break-inside: avoid; } }
</style>
</head>
<body>
)";

constexpr const char* kEnd = "</body>\n</html>\n";

std::string Paragraph(const std::string& text) {
  return fmt::format("<p>{}</p>\n", EscapeHtml(text));
}
std::string Aside(const std::string& text) {
  return fmt::format("<p class=\"aside\">{}</p>\n", EscapeHtml(text));
}

std::string List(const std::vector<std::string>& lines) {
  std::string html = "<ul>\n";
  for (const std::string& line : lines) {
    html += fmt::format("<li>{}</li>\n", EscapeHtml(line));
  }
  return html + "</ul>\n";
}

std::string Section(const std::string& id, const std::string& title, const std::string& body) {
  return fmt::format("<section id=\"{}\">\n<h2>{}</h2>\n{}</section>\n", id, EscapeHtml(title),
                     body);
}

std::string Base64(const std::string& bytes) {
  constexpr int kVariant = sodium_base64_VARIANT_ORIGINAL;
  std::string text(sodium_base64_encoded_len(bytes.size(), kVariant), '\0');
  sodium_bin2base64(text.data(), text.size(), reinterpret_cast<const unsigned char*>(bytes.data()),
                    bytes.size(), kVariant);
  text.pop_back();  // the terminating zero
  return text;
}

std::string Head() {
  const std::string script = kChartScript;
  std::string hash(crypto_hash_sha256_BYTES, '\0');
  crypto_hash_sha256(reinterpret_cast<unsigned char*>(hash.data()),
                     reinterpret_cast<const unsigned char*>(script.data()), script.size());
  return fmt::format(kPolicy, Base64(hash)) + kHead;
}

// A chart, or the reason why there is none.
std::string ChartOr(const Plot& plot, const std::string& what, const std::string& otherwise) {
  return plot.lines.empty() ? Paragraph(otherwise) : ChartHtml(plot, what);
}

std::string TableOr(const Table& table, const std::string& otherwise) {
  return table.empty() ? Paragraph(otherwise) : table.Html();
}

std::string Tile(const std::string& value, const std::string& what) {
  return fmt::format("<li><b>{}</b>{}</li>\n", EscapeHtml(value), EscapeHtml(what));
}

std::string Tiles(const CapturedSession& session, const ReportMetrics& metrics) {
  std::string tiles = Tile(fmt::format("{}", metrics.agents.size()), "agents");
  const size_t num_maps = metrics.groups.size();
  tiles += Tile(fmt::format("{}", num_maps), num_maps == 1 ? "map in the end" : "maps in the end");
  tiles += Tile(fmt::format("{}", session.keyframes.size()), "keyframes");
  if (!metrics.groups.empty() && metrics.groups.front().joint) {
    tiles += Tile(fmt::format("{:.3f} m", metrics.groups.front().joint->position_m.rmse),
                  "joint ATE of the largest map");
  }
  for (const GroupChange& change : session.changes) {
    if (change.fused && change.maps.size() > 1) {
      tiles += Tile(fmt::format("{:.1f} s", change.session_s), "until the first fusion");
      break;
    }
  }
  return fmt::format("<ul class=\"tiles\">\n{}</ul>\n", tiles);
}

std::string Trajectories(const std::vector<Picture>& pictures) {
  std::string html;
  for (size_t i = 0; i + 1 < pictures.size(); ++i) {  // the last is the error
    html += ChartHtml(pictures[i].plot, "Top view: " + pictures[i].plot.title);
  }
  return html + Aside("Top view; a dot is where an agent begins.");
}

std::string Fusions(const CapturedSession& session, const ReportMetrics& metrics) {
  const std::vector<std::string> changes = ChangeLines(session, metrics);
  return GroupTable(metrics).Html() +
         ChartOr(FusionChart(session, metrics), "When maps became one",
                 "No keyframes were captured.") +
         Aside("A bar is a map; it takes the colour of the agent in whose map frame it is.") +
         (changes.empty() ? Paragraph(NoChangeLine(session)) : List(changes));
}

std::string Constraints(const CapturedSession& session, const ReportMetrics& metrics) {
  std::string html = Paragraph(ConstraintsLine(session));
  if (const Table refused = RefusedTable(session); !refused.empty()) {
    html += refused.Html();
  }
  if (const Table truth = TruthTable(metrics); !truth.empty()) {
    html += truth.Html() + Aside(kNeesExplained);
  }
  return html;
}

std::string Processes(const ReportInput& input, const CapturedSession& session) {
  const Table processes = ProcessTable(input, session);
  return processes.empty() ? Paragraph("No process was captured.")
                           : processes.Html() + Aside(kProcessesExplained);
}

std::string Traffic(const CapturedSession& session, const ReportMetrics& metrics) {
  std::string html = ChartOr(TrafficChart(session, metrics), "kB per second on the link",
                             "Not measured second by second: there is no link in a replay, and in "
                             "a log of the server's bus alone.");
  html += TableOr(TrafficTable(metrics), "No bytes were counted.");
  if (const Table links = LinksTable(metrics); !links.empty()) {
    html += Paragraph("Links that the session made bad:") + links.Html() +
            Aside("Delivered counts doubled packets twice.");
  }
  return html;
}

std::string Paper(const ReportMetrics& metrics) {
  std::string html;
  for (const PaperTable& table : PaperTables(metrics)) {
    html += Paragraph(table.title) + table.table.Html();
  }
  return html.empty() ? Paragraph(
                            "The paper's tables are of EuRoC's MH_01 to MH_05; none of this "
                            "session's recordings bears such a name.")
                      : html + Aside(
                                   "The paper's are of the real recordings; of rendered ones, "
                                   "read ours as a check of the system.");
}

// The picture is embedded in the page.
std::string AnchorFigure(const std::string& jpeg) {
  return jpeg.empty()
             ? ""
             : fmt::format("<p><img alt=\"Anchors\" src=\"data:image/jpeg;base64,{}\"/></p>\n",
                           Base64(jpeg)) +
                   Aside(kAnchorPictureExplained);
}

}  // namespace

std::string ReportHtml(const ReportInput& input, const CapturedSession& session,
                       const ReportMetrics& metrics, const std::string& anchors_jpeg) {
  const std::vector<Picture> pictures = Pictures(metrics);
  std::string html = Head();
  html += "<h1>Session report</h1>\n";
  if (!metrics.lost.empty()) {
    html += Paragraph(kLostExplained) + List(metrics.lost);
  }
  html += Tiles(session, metrics);
  html += Section("agents", "Agents", AgentTable(metrics).Html() + Aside(kAteExplained));
  html += Section("trajectories", "Trajectories", Trajectories(pictures));
  std::string error = ChartOr(pictures.back().plot, "Position error over time",
                              "No ground truth is known, so no error.");
  if (const Table live = LiveTable(metrics); !live.empty()) {
    error += Paragraph("What each agent showed while the session ran, from its first fusion on:") +
             live.Html();
  }
  html += Section("error", "Error over time", error);
  html += Section("fusions", "Fusions", Fusions(session, metrics));
  if (const Table anchors = AnchorTable(metrics); !anchors.empty()) {
    html += Section("anchors", "Anchors",
                    anchors.Html() + Aside(kAnchorsExplained) + AnchorFigure(anchors_jpeg));
  }
  html += Section("constraints", "Constraints", Constraints(session, metrics));
  html += Section("load", "Load",
                  ChartOr(LoadChart(session, metrics), "CPU of each process over the session",
                          "No process said anything: a replay has none.") +
                      Processes(input, session));
  html += Section("traffic", "Traffic", Traffic(session, metrics));
  html += Section("paper", "Beside the paper", Paper(metrics));
  html +=
      Section("notes", "Notes", metrics.notes.empty() ? Paragraph("None.") : List(metrics.notes));
  return html + "<script>" + kChartScript + "</script>\n" + kEnd;
}

std::string WithSection(std::string page, const std::string& id, const std::string& title,
                        const Table& table) {
  return page.insert(page.rfind(kEnd), Section(id, title, table.Html()));
}

}  // namespace pangea
