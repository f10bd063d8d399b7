#pragma once

// Line plots, drawn as PNG files by gnuplot (Debian package gnuplot-nox) in a child process. The
// same lines give the same bytes.

#include <Eigen/Core>
#include <limits>
#include <string>
#include <vector>

namespace pangea {

// A point that breaks the line.
inline const Eigen::Vector2d kPlotBreak =
    Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());

struct PlotLine {
  std::string label = {};  // in the legend; empty for none
  std::string name = {};   // shown when hovering; empty: its label
  std::string colour;      // "#rrggbb"
  double width = 2;
  bool dashed = false;
  std::vector<Eigen::Vector2d> points = {};
  bool mark_start = false;  // a dot at the first point
};

struct Plot {
  std::string title;
  std::string x_label;
  std::string y_label;
  bool equal_axes = false;  // the same scale on both axes
  bool y_from_zero = false;
  int height = 1000;  // pixels, for a width of 1400; ignored with equal axes
  // Labels instead of numbers at y = 1, 2, ...
  std::vector<std::string> y_names = {};
  std::vector<PlotLine> lines = {};  // later ones are drawn above earlier ones
};

// Colours that people with any colour vision can distinguish (Okabe & Ito 2008); they repeat after
// seven.
std::string AgentColour(size_t index);
inline constexpr const char* kGroundTruthColour = "#999999";

// Throws std::runtime_error if gnuplot is missing (names the package) or fails.
void WritePng(const Plot& plot, const std::string& path);

}  // namespace pangea
