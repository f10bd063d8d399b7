#pragma once

// A chart of report.html as SVG in the page. The page's script reads the drawing, so that it can
// show each series' value under the pointer and hide a series. (For PNG files see eval/plot.h.)

#include <string>

#include "eval/plot.h"

namespace pangea {

// A figure with title, legend and drawing; `what` is its description for screen readers. `data-x`
// and `data-y` contain the ranges of the axes as "low high from to"; from and to are in units of
// the drawing. `data-pick`: "x" shows every series at one x, "line" the nearest line.
std::string ChartHtml(const Plot& plot, const std::string& what);

// The page's script, for hovering and legends. It reads only the drawings.
extern const char* const kChartScript;

}  // namespace pangea
