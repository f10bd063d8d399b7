#include "report/html/report_svg.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "eval/table.h"

namespace pangea {
namespace {

constexpr double kWidth = 1000;
constexpr double kPlotUnit = 1.4;  // Plot's sizes are for a width of 1400
constexpr double kLeft = 90;       // numbers and names of the y axis
constexpr double kRight = 15;
constexpr double kTop = 12;
constexpr double kBottom = 48;  // numbers and name of the x axis

// The smallest of 1, 2, 5 times a power of ten that is at least `least`.
double NiceStep(double least) {
  const double power = std::pow(10, std::floor(std::log10(least)));
  constexpr std::array<double, 3> kSteps = {1, 2, 5};
  const auto step =
      std::ranges::find_if(kSteps, [&](double s) { return s * power >= least * (1 - 1e-9); });
  return step == kSteps.end() ? 10 * power : *step * power;
}

struct Axis {
  double low = 0;
  double high = 1;
  double from = 0;  // positions of low and high in the drawing
  double to = 1;
  double step = 1;

  double At(double value) const { return from + (value - low) / (high - low) * (to - from); }
  std::string Label(double value) const {
    const int decimals = std::max(0, static_cast<int>(-std::floor(std::log10(step) + 1e-9)));
    return fmt::format("{:.{}f}", std::abs(value) < step / 2 ? 0 : value, decimals);
  }
  std::string Data() const { return fmt::format("{:.9g} {:.9g} {} {}", low, high, from, to); }
};

struct Canvas {
  Axis x;
  Axis y;
  double height = 0;
};

Eigen::AlignedBox2d BoundsOf(const Plot& plot) {
  Eigen::AlignedBox2d box;
  for (const PlotLine& line : plot.lines) {
    for (const Eigen::Vector2d& p : line.points) {
      if (p.allFinite()) {
        box.extend(p);
      }
    }
  }
  return box.isEmpty() ? Eigen::AlignedBox2d(Eigen::Vector2d::Zero(), Eigen::Vector2d::Ones())
                       : box;
}

// Rounds the range to multiples of a nice step, about `steps` of them. A range that numbers of this
// size hardly resolve is widened: its steps could not be counted.
void Round(int steps, Axis* axis) {
  const double largest = std::max(std::abs(axis->low), std::abs(axis->high));
  if (axis->high - axis->low <= 1e-9 * largest) {
    axis->high = axis->low + std::max(1e-6, std::abs(axis->low));
  }
  axis->step = NiceStep((axis->high - axis->low) / steps);
  axis->low = axis->step * std::floor(axis->low / axis->step + 1e-9);
  axis->high = axis->step * std::ceil(axis->high / axis->step - 1e-9);
}

// Widens, on both sides, the range of the axis with the longer unit. Both axes then have one step,
// or a straight walk would have as many numbers beside it as its width fits into its length.
void MakeUnitsEqual(Canvas* canvas) {
  const auto unit = [](const Axis& axis) {
    return std::abs(axis.to - axis.from) / (axis.high - axis.low);
  };
  const double smaller = std::min(unit(canvas->x), unit(canvas->y));
  for (Axis* axis : {&canvas->x, &canvas->y}) {
    const double more = (axis->high - axis->low) * (unit(*axis) / smaller - 1);
    axis->low -= more / 2;
    axis->high += more / 2;
  }
  canvas->x.step = canvas->y.step = std::max(canvas->x.step, canvas->y.step);
}

Canvas CanvasOf(const Plot& plot) {
  const Eigen::AlignedBox2d box = BoundsOf(plot);
  Canvas canvas{{box.min().x(), box.max().x(), kLeft, kWidth - kRight}, {}, 0};
  Round(8, &canvas.x);
  canvas.y.low = plot.y_from_zero ? 0 : box.min().y();
  canvas.y.high = box.max().y();
  Round(6, &canvas.y);
  canvas.height = plot.height / kPlotUnit;
  if (plot.equal_axes) {
    const double aspect = (canvas.y.high - canvas.y.low) / (canvas.x.high - canvas.x.low);
    canvas.height =
        std::clamp(aspect * (canvas.x.to - canvas.x.from), 250.0, 800.0) + kTop + kBottom;
  }
  if (!plot.y_names.empty()) {
    canvas.y.low = 0.4;
    canvas.y.high = static_cast<double>(plot.y_names.size()) + 0.6;
  }
  canvas.y.from = canvas.height - kBottom;
  canvas.y.to = kTop;
  if (plot.equal_axes) {
    MakeUnitsEqual(&canvas);
  }
  return canvas;
}

std::string Text(double x, double y, const char* anchor, const std::string& text) {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\">{}</text>\n", x, y, anchor,
                     EscapeHtml(text));
}

std::string Rule(double x1, double y1, double x2, double y2) {
  return fmt::format("<path class=\"grid\" d=\"M{:.1f} {:.1f}L{:.1f} {:.1f}\"/>\n", x1, y1, x2, y2);
}

std::string XAxis(const Plot& plot, const Canvas& canvas) {
  std::string svg = Text(500, canvas.height - 6, "middle", plot.x_label);
  for (double i = std::ceil(canvas.x.low / canvas.x.step - 1e-9);
       i * canvas.x.step <= canvas.x.high + 1e-9 * canvas.x.step; ++i) {
    const double x = canvas.x.At(i * canvas.x.step);
    svg += Rule(x, canvas.y.from, x, canvas.y.to) +
           Text(x, canvas.y.from + 18, "middle", canvas.x.Label(i * canvas.x.step));
  }
  return svg;
}

std::string YAxis(const Plot& plot, const Canvas& canvas) {
  std::string svg = fmt::format("<g transform=\"translate(16 {:.1f}) rotate(-90)\">{}</g>\n",
                                canvas.height / 2, Text(0, 0, "middle", plot.y_label));
  const auto tick = [&](double value, const std::string& name) {
    const double y = canvas.y.At(value);
    svg += Rule(canvas.x.from, y, canvas.x.to, y) + Text(canvas.x.from - 8, y + 5, "end", name);
  };
  for (size_t i = 0; i < plot.y_names.size(); ++i) {
    tick(static_cast<double>(i + 1), plot.y_names[i]);
  }
  for (double i = std::ceil(canvas.y.low / canvas.y.step - 1e-9);
       plot.y_names.empty() && i * canvas.y.step <= canvas.y.high + 1e-9 * canvas.y.step; ++i) {
    tick(i * canvas.y.step, canvas.y.Label(i * canvas.y.step));
  }
  return svg;
}

// One polyline for each part between breaks.
std::string Stretches(const PlotLine& line, const Canvas& canvas) {
  std::string svg;
  std::string points;
  const auto end = [&] {
    if (!points.empty()) {
      svg += fmt::format("<polyline points=\"{}\"/>", points);
    }
    points.clear();
  };
  for (const Eigen::Vector2d& p : line.points) {
    if (p.allFinite()) {
      points += fmt::format("{}{:.2f},{:.2f}", points.empty() ? "" : " ", canvas.x.At(p.x()),
                            canvas.y.At(p.y()));
    } else {
      end();
    }
  }
  end();
  return svg;
}

const std::string& NameOf(const PlotLine& line) {
  return line.name.empty() ? line.label : line.name;
}

std::string LineSvg(const PlotLine& line, const Canvas& canvas) {
  std::string svg = fmt::format(
      "<g class=\"line{}\" data-name=\"{}\" style=\"--line: {}\" stroke-width=\"{:.1f}\">",
      line.dashed ? " dashed" : "", EscapeHtml(NameOf(line)), line.colour, line.width / kPlotUnit);
  svg += Stretches(line, canvas);
  const auto start = std::ranges::find_if(line.points, [](const auto& p) { return p.allFinite(); });
  if (line.mark_start && start != line.points.end()) {
    svg += fmt::format("<circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"5\"/>", canvas.x.At(start->x()),
                       canvas.y.At(start->y()));
  }
  return svg + "</g>\n";
}

std::string Legend(const Plot& plot) {
  std::string html = "<p class=\"legend\">\n";
  for (const PlotLine& line : plot.lines) {
    if (!line.label.empty()) {
      html += fmt::format(
          "<button type=\"button\" aria-pressed=\"true\" data-name=\"{}\" style=\"--line: {}\">"
          "<span class=\"{}\"></span>{}</button>\n",
          EscapeHtml(NameOf(line)), line.colour, line.dashed ? "dashed" : "",
          EscapeHtml(line.label));
    }
  }
  return html + "</p>\n";
}

}  // namespace

std::string ChartHtml(const Plot& plot, const std::string& what) {
  const Canvas canvas = CanvasOf(plot);
  const bool nearest = plot.equal_axes || !plot.y_names.empty();
  std::string html = fmt::format("<figure class=\"chart\">\n<figcaption>{}</figcaption>\n{}",
                                 EscapeHtml(plot.title), Legend(plot));
  html += fmt::format(
      "<svg viewBox=\"0 0 {} {:.0f}\" role=\"img\" aria-label=\"{}\" data-x=\"{}\" data-y=\"{}\" "
      "data-x-label=\"{}\" data-y-label=\"{}\" data-pick=\"{}\">\n",
      kWidth, canvas.height, EscapeHtml(what), canvas.x.Data(), canvas.y.Data(),
      EscapeHtml(plot.x_label), EscapeHtml(plot.y_label), nearest ? "line" : "x");
  html += XAxis(plot, canvas) + YAxis(plot, canvas);
  for (const PlotLine& line : plot.lines) {
    html += LineSvg(line, canvas);
  }
  return html + "</svg>\n<output class=\"tip\" hidden=\"\"></output>\n</figure>\n";
}

}  // namespace pangea
