// Tests charts of report.html: a value is drawn at the place that the axes give it, in every plot.

#include "report/html/report_svg.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <boost/property_tree/ptree.hpp>
#include <boost/property_tree/xml_parser.hpp>
#include <cmath>
#include <sstream>

namespace pangea {
namespace {

using boost::property_tree::ptree;
using ::testing::ElementsAre;
using ::testing::SizeIs;

struct DrawnAxis {
  double low = 0;
  double high = 0;
  double from = 0;
  double to = 0;
  double Value(double at) const { return low + (at - from) / (to - from) * (high - low); }
  double Unit() const { return std::abs(to - from) / (high - low); }
};

DrawnAxis AxisOf(const ptree& svg, const std::string& name) {
  DrawnAxis axis;
  std::istringstream stream(svg.get<std::string>("<xmlattr>." + name));
  stream >> axis.low >> axis.high >> axis.from >> axis.to;
  return axis;
}

// The points of a chart's lines, read back from the drawing as a browser's script does.
struct Drawn {
  DrawnAxis x;
  DrawnAxis y;
  std::vector<std::string> names;
  std::vector<std::vector<Eigen::Vector2d>> stretches;
  std::vector<std::string> buttons;
};

Drawn Draw(const Plot& plot) {
  std::istringstream stream(ChartHtml(plot, "a test"));
  ptree page;
  boost::property_tree::read_xml(stream, page);
  const ptree& svg = page.get_child("figure.svg");
  Drawn drawn{AxisOf(svg, "data-x"), AxisOf(svg, "data-y"), {}, {}, {}};
  for (const auto& [tag, group] : svg) {
    if (tag != "g" || !group.get_optional<std::string>("<xmlattr>.data-name")) {
      continue;
    }
    drawn.names.push_back(group.get<std::string>("<xmlattr>.data-name"));
    for (const auto& [part, polyline] : group) {
      if (part == "polyline") {
        std::istringstream points(polyline.get<std::string>("<xmlattr>.points"));
        drawn.stretches.emplace_back();
        char comma = 0;
        for (double x = 0, y = 0; points >> x >> comma >> y;) {
          drawn.stretches.back().emplace_back(drawn.x.Value(x), drawn.y.Value(y));
        }
      }
    }
  }
  for (const auto& [tag, button] : page.get_child("figure.p")) {
    if (tag == "button") {
      drawn.buttons.push_back(button.get<std::string>("<xmlattr>.data-name"));
    }
  }
  return drawn;
}

TEST(ReportSvg, ValuesCanBeReadBack) {
  Plot plot{.title = "t", .x_label = "x [s]", .y_label = "y [m]"};
  plot.lines.push_back(
      {.label = "a", .colour = AgentColour(0), .points = {{3, -0.02}, {47, 0.31}}});
  const Drawn drawn = Draw(plot);
  ASSERT_THAT(drawn.stretches, SizeIs(1));
  ASSERT_THAT(drawn.stretches[0], SizeIs(2));
  for (const size_t i : {0, 1}) {
    // Drawn positions are rounded to 0.01 units; 50 s are 900 units, and 0.4 m are some hundreds.
    EXPECT_NEAR(drawn.stretches[0][i].x(), plot.lines[0].points[i].x(), 5e-4);
    EXPECT_NEAR(drawn.stretches[0][i].y(), plot.lines[0].points[i].y(), 1e-5);
  }
  EXPECT_LE(drawn.x.low, 3);
  EXPECT_GE(drawn.x.high, 47);
  EXPECT_GT(drawn.y.from, drawn.y.to) << "up is up";
}

TEST(ReportSvg, BreaksBreakTheLineAndNamesAreTexts) {
  const std::string nasty = "<b>\"it's\" & more</b>";
  Plot plot;
  plot.lines.push_back({.label = nasty,
                        .colour = AgentColour(0),
                        .points = {kPlotBreak, {0, 0}, {1, 1}, kPlotBreak, kPlotBreak, {2, 2}}});
  plot.lines.push_back({.name = "b", .colour = AgentColour(1), .points = {{0, 1}, {2, 1}}});
  const Drawn drawn = Draw(plot);
  EXPECT_THAT(drawn.stretches, ElementsAre(SizeIs(2), SizeIs(1), SizeIs(2)));
  EXPECT_THAT(drawn.names, ElementsAre(nasty, "b"));
  EXPECT_THAT(drawn.buttons, ElementsAre(nasty));
}

TEST(ReportSvg, EqualAxesHaveEqualUnitsAndHoldEverything) {
  for (const auto& [width, height] : {std::pair{40.0, 1.0}, {1.0, 40.0}, {7.0, 6.0}}) {
    Plot plot;
    plot.equal_axes = true;
    plot.lines.push_back({.colour = AgentColour(0), .points = {{-width, 5}, {width, 5 + height}}});
    const Drawn drawn = Draw(plot);
    EXPECT_NEAR(drawn.x.Unit() / drawn.y.Unit(), 1, 1e-6);
    EXPECT_LE(drawn.x.low, -width);
    EXPECT_GE(drawn.x.high, width);
    EXPECT_LE(drawn.y.low, 5);
    EXPECT_GE(drawn.y.high, 5 + height);
  }
}

int NumGridLines(const Plot& plot) {
  const std::string html = ChartHtml(plot, "a test");
  int count = 0;
  for (size_t at = html.find("\"grid\""); at != std::string::npos;
       at = html.find("\"grid\"", at + 1)) {
    ++count;
  }
  return count;
}

TEST(ReportSvg, AStraightWalkHasFewGridLines) {
  for (const double sideways : {0.1, 1e-3, 0.0, 1e-15}) {
    for (const bool along_x : {true, false}) {
      Plot plot;
      plot.equal_axes = true;
      const Eigen::Vector2d end(10, 3 + sideways);
      plot.lines.push_back({.colour = AgentColour(0), .points = {{0, 3}, end}});
      if (!along_x) {
        plot.lines[0].points = {{3, 0}, end.reverse()};
      }
      ASSERT_LT(NumGridLines(plot), 40) << sideways;
      EXPECT_GT(NumGridLines(plot), 3) << sideways;
    }
  }
}

TEST(ReportSvg, NothingAndASinglePointAreDrawnToo) {
  EXPECT_THAT(Draw(Plot()).stretches, SizeIs(0));
  Plot plot;
  plot.y_from_zero = true;
  plot.lines.push_back({.colour = AgentColour(0), .points = {{12, 0}}});
  const Drawn drawn = Draw(plot);
  ASSERT_THAT(drawn.stretches, ElementsAre(SizeIs(1)));
  EXPECT_NEAR(drawn.stretches[0][0].x(), 12, 1e-3);
  EXPECT_NEAR(drawn.stretches[0][0].y(), 0, 1e-6);
}

}  // namespace
}  // namespace pangea
