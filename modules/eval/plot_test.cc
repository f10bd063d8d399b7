#include "eval/plot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <stdexcept>

#include "eval/table.h"
#include "files/testing/full_disk.h"

namespace pangea {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

class PlotTest : public ::testing::Test {
 protected:
  void SetUp() override { std::filesystem::remove(path_); }
  std::string Bytes() const {
    std::ifstream file(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  }
  static Plot Circle() {
    Plot plot{.title = "agent's circle", .x_label = "x", .y_label = "y", .equal_axes = true};
    plot.lines.push_back({.label = "it's a circle_1", .colour = AgentColour(0)});
    for (int i = 0; i < 100; ++i) {
      plot.lines[0].points.emplace_back(std::cos(0.06 * i), std::sin(0.06 * i));
    }
    plot.lines[0].points.insert(plot.lines[0].points.begin() + 50, kPlotBreak);
    plot.lines[0].mark_start = true;
    return plot;
  }
  const std::string path_ = ::testing::TempDir() + "pangea plot's test.png";
};

TEST_F(PlotTest, WritesTheSamePngTwice) {
  WritePng(Circle(), path_);
  const std::string first = Bytes();
  EXPECT_THAT(first, StartsWith("\x89PNG"));
  EXPECT_GT(first.size(), 5000U);
  WritePng(Circle(), path_);
  EXPECT_EQ(Bytes(), first);
}

TEST_F(PlotTest, NothingToDrawIsAPictureToo) {
  Plot plot;
  plot.lines.push_back({.label = "empty", .colour = AgentColour(0), .points = {kPlotBreak}});
  WritePng(plot, path_);
  EXPECT_THAT(Bytes(), StartsWith("\x89PNG"));
}

TEST(TableTest, HtmlHoldsTextsAsTheyAre) {
  Table table({"a < b", "n"});
  EXPECT_TRUE(table.empty());
  table.Add({"x & \"y\"", "1.5 %"});
  EXPECT_FALSE(table.empty());
  EXPECT_THAT(table.Html(), HasSubstr("<th>a &lt; b</th>"));
  EXPECT_THAT(table.Html(), HasSubstr("<td>x &amp; &quot;y&quot;</td><td class=\"n\">1.5 %</td>"));
}

TEST(TableTest, WhatIsNoUtf8IsReplaced) {
  const std::string replaced = "\xef\xbf\xbd";
  EXPECT_EQ(EscapeHtml("\xc3\xa9'\n"), "\xc3\xa9&#39;\n");
  EXPECT_EQ(EscapeHtml("\xff"
                       "a"),
            replaced + "a");
  EXPECT_EQ(EscapeHtml("\xc3"), replaced);
  EXPECT_EQ(EscapeHtml("\xe2\x82"
                       "b"),
            replaced + replaced + "b");
  EXPECT_EQ(EscapeHtml(std::string("\0\x01", 2)), replaced + replaced);
}

TEST_F(PlotTest, FailuresAreReportedWithTheMend) {
  EXPECT_THROW(WritePng(Circle(), "/nonexistent/folder/a.png"), std::runtime_error);
  const std::string path = std::getenv("PATH");
  setenv("PATH", "/nonexistent", 1);
  try {
    WritePng(Circle(), path_);
    ADD_FAILURE() << "gnuplot is not there, yet no error";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("install gnuplot-nox"));
  }
  setenv("PATH", path.c_str(), 1);
}

// As on a full disk, which gnuplot does not report.
TEST_F(PlotTest, APictureThatIsCutOffIsNone) {
  const FullDisk full(4600);
  EXPECT_THAT([&] { WritePng(Circle(), path_); },
              ::testing::ThrowsMessage<std::runtime_error>(HasSubstr("the picture is cut off")));
}

TEST_F(PlotTest, SevenAgentsHaveSevenColours) {
  std::set<std::string> colours;
  for (size_t i = 0; i < 7; ++i) {
    colours.insert(AgentColour(i));
  }
  EXPECT_EQ(colours.size(), 7U);
  EXPECT_FALSE(colours.contains(kGroundTruthColour));
}

}  // namespace
}  // namespace pangea
