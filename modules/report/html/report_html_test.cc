// Tests report.html: the page parses, has every section, needs no other file, and shows texts
// literally. Also tests the charts and tables that only this page has.

#include "report/html/report_html.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <boost/property_tree/ptree.hpp>
#include <boost/property_tree/xml_parser.hpp>
#include <sstream>

#include "messages/channels.h"
#include "report/html/report_charts.h"
#include "report/metrics/report_paper.h"
#include "report/report_test_world.h"

namespace pangea {
namespace {

using boost::property_tree::ptree;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

class ReportHtmlTest : public ReportWorld {
 protected:
  ptree Page() {
    Report();
    html_ = Text("report.html");
    std::istringstream stream(html_);
    ptree page;
    boost::property_tree::read_xml(stream, page);  // throws where a tag or an entity is not closed
    return page;
  }

  static std::vector<std::string> SectionIds(const ptree& page) {
    std::vector<std::string> ids;
    for (const auto& [tag, element] : page.get_child("html.body")) {
      if (tag == "section") {
        ids.push_back(element.get<std::string>("<xmlattr>.id"));
      }
    }
    return ids;
  }

  static void Collect(const ptree& element, const std::string& wanted,
                      std::vector<std::string>* found) {
    for (const auto& [tag, child] : element) {
      if (tag == wanted) {
        found->push_back(child.data());
      }
      Collect(child, wanted, found);
    }
  }

  void LogStatus(const std::string& process, double cpu_s) {
    status_t status{};
    status.process = process;
    status.cpu_s = static_cast<float>(cpu_s);
    log_->Write(channels::Status(process), status);
  }

  std::string html_;
};

TEST_F(ReportHtmlTest, ParsesAndHasEverySection) {
  LogBoth();
  LogState(State(1, {Map(1), Map(2)}, NumKeyframes()));
  LogStatus("fusion", 1);
  LogStatus("fusion", 2);
  const ptree page = Page();
  EXPECT_THAT(SectionIds(page), ElementsAre("agents", "trajectories", "error", "fusions",
                                            "constraints", "load", "traffic", "paper", "notes"));
  std::vector<std::string> charts;
  Collect(page, "aria-label", &charts);  // attributes are children too
  EXPECT_EQ(charts.size(), 5U) << "trajectories, error, fusions, load, traffic";
  std::vector<std::string> cells;
  Collect(page, "td", &cells);
  EXPECT_THAT(cells, Contains("fusion"));
}

TEST_F(ReportHtmlTest, ASectionMayBeAddedAtItsEnd) {
  Page();
  Table table({"expected", "value"});
  table.Add({"ate_joint_m", "0.1 < 0.2"});
  std::istringstream stream(WithSection(html_, "expectations", "Expectations", table));
  ptree page;
  boost::property_tree::read_xml(stream, page);
  EXPECT_EQ(SectionIds(page).back(), "expectations");
  EXPECT_EQ(SectionIds(page).size(), 10U);
}

TEST_F(ReportHtmlTest, FetchesNothing) {
  LogBoth();
  Page();
  for (const char* tag : {"<link", "<img", "<iframe", "http://", "https://", "url(", "src="}) {
    EXPECT_THAT(html_, Not(HasSubstr(tag)));
  }
  EXPECT_THAT(html_, HasSubstr("default-src 'none'"));
  EXPECT_EQ(html_.find("<script"), html_.rfind("<script")) << "one script, known by its hash";
}

TEST_F(ReportHtmlTest, TextsOfALogAreTextsOfThePage) {
  const std::string nasty = "<script>alert('x')</script> & \"more\" \xff";
  LogBoth();
  LogConstraint(3, false, nasty);
  input_.notes.push_back(nasty);
  input_.agents[1].link->conditions = nasty;
  const ptree page = Page();
  const std::string shown = "<script>alert('x')</script> & \"more\" \xef\xbf\xbd";
  std::vector<std::string> texts;
  Collect(page, "td", &texts);
  Collect(page, "li", &texts);
  EXPECT_EQ(std::ranges::count(texts, shown), 3);
}

TEST_F(ReportHtmlTest, AnEmptyLogGivesAWholePage) {
  const ptree page = Page();
  EXPECT_EQ(SectionIds(page).size(), 9U);
  EXPECT_THAT(html_, HasSubstr("No process was captured."));
  EXPECT_THAT(html_, HasSubstr("No maps were fused."));
}

CapturedSession SessionOfTwoMaps() {
  CapturedSession session;
  session.begin_utime = 1'000'000;
  for (const int32_t agent : {1, 2}) {
    session.keyframes[{{agent, 5}, 0}].session_s = agent;
    session.keyframes[{{agent, 5}, 1}].session_s = 10 + agent;
  }
  return session;
}

ReportMetrics MetricsOfTwoAgents() {
  ReportMetrics metrics;
  for (const int32_t agent : {1, 2}) {
    metrics.agents.emplace_back();
    metrics.agents.back().id = agent;
  }
  return metrics;
}

TEST(ReportCharts, AMapTakesTheColourOfItsGroup) {
  CapturedSession session = SessionOfTwoMaps();
  session.changes.push_back({true, 4.0, 1, {1, 5}, {{1, 5}, {2, 5}}, {}});
  const Plot plot = FusionChart(session, MetricsOfTwoAgents());
  EXPECT_THAT(plot.y_names, ElementsAre("agent 2", "agent 1"));
  ASSERT_EQ(plot.lines.size(), 4U) << "agent 2 before, both after, and what joins them";
  EXPECT_EQ(plot.lines[0].colour, AgentColour(1));
  EXPECT_EQ(plot.lines[0].points.front(), Eigen::Vector2d(2, 1));
  EXPECT_EQ(plot.lines[0].points.back(), Eigen::Vector2d(4, 1));
  EXPECT_EQ(plot.lines[1].colour, AgentColour(0));
  EXPECT_EQ(plot.lines[2].colour, AgentColour(0));
  EXPECT_EQ(plot.lines[0].name, "agent 2, 2.0 to 4.0 s: in agent 2's map frame");
  EXPECT_EQ(plot.lines[2].name, "agent 2, 4.0 to 12.0 s: in agent 1's map frame");
  EXPECT_EQ(plot.lines[2].points.front(), Eigen::Vector2d(4, 1));
  EXPECT_EQ(plot.lines[2].points.back(), Eigen::Vector2d(12, 1));
}

TEST(ReportCharts, TwoMapsOfOneAgentBecomeOneToo) {
  CapturedSession session = SessionOfTwoMaps();
  session.keyframes[{{1, 9}, 0}].session_s = 6;
  session.changes.push_back({true, 8.0, 1, {1, 5}, {{1, 5}, {1, 9}}, {}});
  const Plot plot = FusionChart(session, MetricsOfTwoAgents());
  EXPECT_THAT(plot.y_names, ElementsAre("agent 2", "agent 1, map 2", "agent 1"));
  ASSERT_EQ(plot.lines.size(), 5U) << "the second map before, all three, and what joins two";
  EXPECT_EQ(plot.lines[0].name, "agent 1, map 2, 6.0 to 8.0 s: in agent 1's map frame");
  EXPECT_EQ(plot.lines[4].points.front(), Eigen::Vector2d(8, 2));
  EXPECT_EQ(plot.lines[4].points.back(), Eigen::Vector2d(8, 3));
}

TEST(ReportCharts, LoadIsCpuTimePerSecondAndARestartBreaksTheLine) {
  CapturedSession session = SessionOfTwoMaps();
  for (const auto& [utime, cpu_s] :
       {std::pair{2'000'000, 1.0}, {3'000'000, 1.5}, {5'000'000, 2.5}, {6'000'000, 0.1}}) {
    session.samples["fusion"].push_back({utime, cpu_s, {}, {}});
  }
  const Plot plot = LoadChart(session, MetricsOfTwoAgents());
  ASSERT_EQ(plot.lines.size(), 1U);
  ASSERT_EQ(plot.lines[0].points.size(), 3U);
  EXPECT_LT((plot.lines[0].points[0] - Eigen::Vector2d(2, 50)).norm(), 1e-9);
  EXPECT_LT((plot.lines[0].points[1] - Eigen::Vector2d(4, 50)).norm(), 1e-9);
  EXPECT_FALSE(plot.lines[0].points[2].allFinite());
}

TEST(ReportCharts, TrafficIsTheUplinksCountersPerSecond) {
  ReportMetrics metrics = MetricsOfTwoAgents();
  metrics.agents[1].samples["uplink_2"] = {{2'000'000, 0, 1'000, 10}, {4'000'000, 0, 61'000, 210}};
  metrics.agents[1].samples["vio_2"] = {{2'000'000, 0, {}, {}}, {4'000'000, 1, {}, {}}};
  const Plot plot = TrafficChart(SessionOfTwoMaps(), metrics);
  ASSERT_EQ(plot.lines.size(), 2U);
  EXPECT_EQ(plot.lines[0].label, "agent 2 sends");
  EXPECT_LT((plot.lines[0].points[0] - Eigen::Vector2d(3, 30)).norm(), 1e-9);
  EXPECT_EQ(plot.lines[1].label, "agent 2 receives");
  EXPECT_LT((plot.lines[1].points[0] - Eigen::Vector2d(3, 0.1)).norm(), 1e-9);
  EXPECT_TRUE(TrafficChart(SessionOfTwoMaps(), MetricsOfTwoAgents()).lines.empty());
}

TEST(ReportPaper, SequencesAreKnownByTheirFolder) {
  EXPECT_EQ(SequenceOf("data/MH_01"), "MH_01");
  EXPECT_EQ(SequenceOf("/data/MH_05_difficult/mav0/"), "MH_05");
  EXPECT_EQ(SequenceOf("MH_03"), "MH_03");
  EXPECT_EQ(SequenceOf("data/MH_01/walk"), std::nullopt);
  EXPECT_EQ(SequenceOf("V1_01_easy"), std::nullopt);
  EXPECT_EQ(SequenceOf(""), std::nullopt);
  EXPECT_EQ(SequenceOf("/"), std::nullopt);
}

// Metrics of two agents in one map; `duration_s`: the played part of their recordings.
ReportMetrics Played(const std::string& first, const std::string& second,
                     std::optional<double> duration_s) {
  ReportMetrics metrics = MetricsOfTwoAgents();
  metrics.groups.emplace_back();
  metrics.groups[0].joint.emplace();
  metrics.groups[0].joint->position_m.rmse = 0.0333;
  for (AgentMetrics& agent : metrics.agents) {
    agent.run.recording = agent.id == 1 ? first : second;
    agent.run.duration_s = duration_s;
    agent.server.emplace();
    agent.server->position_m.rmse = 0.011 * agent.id;
    metrics.groups[0].group.keyframes.push_back({{{agent.id, 5}, 0}, 0, {}});
  }
  return metrics;
}

TEST(ReportPaper, TwoSequencesStandInTablesIIAndIV) {
  const auto tables = PaperTables(Played("a/MH_04", "a/MH_05", std::nullopt));
  ASSERT_EQ(tables.size(), 2U);
  EXPECT_THAT(tables[0].title, HasSubstr("Table II:"));
  EXPECT_THAT(tables[0].table.Text(), HasSubstr("| MH_04     | -              | 0.011 "));
  EXPECT_THAT(tables[1].title, HasSubstr("Table IV"));
  EXPECT_THAT(tables[1].table.Text(), HasSubstr("| MH_04 | MH_05  | 0.022 | 0.090"));
}

TEST(ReportPaper, HalvesOfOneStandInTableIII) {
  const auto tables = PaperTables(Played("MH_02", "MH_02", 60));
  ASSERT_EQ(tables.size(), 1U);
  EXPECT_THAT(tables[0].title, HasSubstr("Table III"));
  EXPECT_THAT(tables[0].table.Text(), HasSubstr("| MH_02     | 0.033 | 0.080"));
  EXPECT_TRUE(PaperTables(Played("walk_1", "walk_2", std::nullopt)).empty());
}

}  // namespace
}  // namespace pangea
