#pragma once

// A chart of report.html as SVG in the page: what is drawn is also what its script reads, so that
// every series can be asked for its value under the pointer and be taken away. (PNG files are
// gnuplot's: eval/plot.h.)

#include <string>

#include "eval/plot.h"

namespace pangea::session {

// A figure with a title, a legend and the drawing; `what` is for those who do not see it. The
// ranges of the axes stand in `data-x` and `data-y` as "low high from to": from, to are the ends
// in units of the drawing. `data-pick`: "x" asks every series at one x, "line" the nearest line.
std::string ChartHtml(const Plot& plot, const std::string& what);

// The page's script: hovering and the legends. It reads the drawings, fetches nothing.
extern const char* const kChartScript;

}  // namespace pangea::session
