#include "sim/scene/painter.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

namespace pangea::sim {
namespace {

// A sheet being painted: image and scale.
struct Sheet {
  cv::Mat image;  // 8-bit
  double texel_m;
  double tone;
  Rng* rng;

  int Texels(double metres) const {
    return std::max(1, static_cast<int>(std::lround(metres / texel_m)));
  }
  double Area() const { return texel_m * texel_m * static_cast<double>(image.total()); }
  // Number of things to draw for a density.
  int Count(double per_m2) const { return static_cast<int>(per_m2 * Area() + rng->Uniform()); }
  cv::Point RandomPoint() const { return {rng->Index(image.cols), rng->Index(image.rows)}; }
  int Grey(double low, double high) const { return static_cast<int>(rng->Uniform(low, high)); }
  // The grey of a mark: mostly near the sheet's tone, sometimes far from it.
  int Mark() const {
    const double grey = rng->Chance(0.3) ? rng->Uniform(5, 250) : tone + 32 * rng->Normal();
    return static_cast<int>(std::clamp(grey, 0.0, 255.0));
  }
};

// Smooth noise with cells of `cell` texels, values about -1 .. 1.
cv::Mat SmoothNoise(cv::Size size, double cell, Rng* rng) {
  const cv::Size grid(std::max(2, static_cast<int>(size.width / cell) + 2),
                      std::max(2, static_cast<int>(size.height / cell) + 2));
  cv::Mat coarse(grid, CV_32F);
  for (int y = 0; y < grid.height; ++y) {
    for (int x = 0; x < grid.width; ++x) {
      coarse.at<float>(y, x) = static_cast<float>(rng->Uniform(-1, 1));
    }
  }
  cv::Mat noise;
  cv::resize(coarse, noise, size, 0, 0, cv::INTER_CUBIC);
  return noise;
}

cv::Mat BaseCoat(cv::Size size, const SheetStyle& style, double texel_m, Rng* rng) {
  cv::Mat coat(size, CV_32F, cv::Scalar(style.tone));
  double amplitude = style.noise;
  for (double cell_m = 2.5; cell_m > 1.5 * texel_m; cell_m *= 0.4) {
    coat += amplitude * SmoothNoise(size, cell_m / texel_m, rng);
    amplitude *= 0.68;
  }
  cv::Mat stain = SmoothNoise(size, 0.7 / texel_m, rng);
  stain += 0.6 * SmoothNoise(size, 0.2 / texel_m, rng);
  cv::max(stain - 0.45, 0.0, stain);
  coat -= style.stain * stain;
  cv::Mat image;
  coat.convertTo(image, CV_8U);
  return image;
}

void PaintRivets(Sheet* sheet, const cv::Rect& panel) {
  const int radius = std::max(1, sheet->Texels(sheet->rng->Uniform(0.006, 0.016)));
  const int inset = 2 * radius + 2;
  const int step = sheet->Texels(sheet->rng->Uniform(0.12, 0.3));
  const int grey = sheet->rng->Chance(0.5) ? sheet->Grey(150, 230) : sheet->Grey(10, 50);
  for (int x = panel.x + inset; x < panel.br().x - inset; x += step) {
    for (const int y : {panel.y + inset, panel.br().y - inset}) {
      if (sheet->rng->Chance(0.85)) {
        cv::circle(sheet->image, {x, y}, radius, grey, cv::FILLED);
      }
    }
  }
}

// Splits until the panels are about the style's size; each gets its own tone, seams and rivets.
void PaintPanels(Sheet* sheet, const cv::Rect& panel, double panel_m) {
  const double longest = std::max(panel.width, panel.height) * sheet->texel_m;
  if (longest > panel_m * sheet->rng->Uniform(0.7, 2.2) && longest > 8 * sheet->texel_m) {
    const double share = sheet->rng->Uniform(0.3, 0.7);
    cv::Rect a = panel;
    cv::Rect b = panel;
    if (panel.width > panel.height) {
      a.width = static_cast<int>(panel.width * share);
      b.x += a.width;
      b.width -= a.width;
    } else {
      a.height = static_cast<int>(panel.height * share);
      b.y += a.height;
      b.height -= a.height;
    }
    PaintPanels(sheet, a, panel_m);
    PaintPanels(sheet, b, panel_m);
    return;
  }
  cv::Mat area = sheet->image(panel);
  const double tone = 22 * sheet->rng->Normal();
  area.convertTo(area, CV_8U, sheet->rng->Uniform(0.8, 1.2), tone);
  const int seam = std::max(1, sheet->Texels(sheet->rng->Uniform(0.004, 0.02)));
  cv::rectangle(sheet->image, panel, sheet->Mark(), seam);
  if (sheet->rng->Chance(0.4)) {
    PaintRivets(sheet, panel);
  }
}

void PaintPolygon(Sheet* sheet, double size_m) {
  const cv::Point centre = sheet->RandomPoint();
  const int corners = 3 + sheet->rng->Index(3);
  const double rotation = sheet->rng->Uniform(0, 2 * M_PI);
  std::vector<cv::Point> points;
  for (int i = 0; i < corners; ++i) {
    const double angle = rotation + 2 * M_PI * (i + sheet->rng->Uniform(-0.3, 0.3)) / corners;
    const double radius = sheet->rng->Uniform(0.4, 1.0) * size_m / sheet->texel_m;
    points.emplace_back(centre.x + static_cast<int>(radius * std::cos(angle)),
                        centre.y + static_cast<int>(radius * std::sin(angle)));
  }
  const int grey = sheet->Mark();
  if (sheet->rng->Chance(0.6)) {
    cv::fillPoly(sheet->image, std::vector<std::vector<cv::Point>>{points}, grey);
  } else {
    cv::polylines(sheet->image, std::vector<std::vector<cv::Point>>{points}, true, grey,
                  sheet->Texels(0.08 * size_m));
  }
}

void PaintLabel(Sheet* sheet, double size_m) {
  const int width = sheet->Texels(size_m * sheet->rng->Uniform(1.0, 2.5));
  const int height = sheet->Texels(size_m * sheet->rng->Uniform(0.6, 1.2));
  const cv::Rect label(sheet->RandomPoint(), cv::Size(width, height));
  const bool bright = sheet->rng->Chance(0.7);
  const int paper = bright ? sheet->Grey(180, 250) : sheet->Grey(5, 50);
  const int ink = bright ? sheet->Grey(5, 60) : sheet->Grey(180, 250);
  cv::rectangle(sheet->image, label, paper, cv::FILLED);
  cv::rectangle(sheet->image, label, ink, std::max(1, height / 16));
  std::string text;
  for (int i = 0; i < 3 + sheet->rng->Index(4); ++i) {
    text += "0123456789ABCDEFHKLMNPRTUXYZ-/"[sheet->rng->Index(30)];
  }
  const double scale = 0.028 * height;
  cv::putText(sheet->image, text, label.tl() + cv::Point(height / 8, 3 * height / 4),
              cv::FONT_HERSHEY_SIMPLEX, scale, ink, std::max(1, height / 10));
}

void PaintStripes(Sheet* sheet, double size_m) {
  const int width = sheet->Texels(size_m * sheet->rng->Uniform(2, 6));
  const int height = sheet->Texels(0.4 * size_m);
  const cv::Rect band = cv::Rect(sheet->RandomPoint(), cv::Size(width, height)) &
                        cv::Rect(cv::Point(0, 0), sheet->image.size());
  if (band.empty()) {
    return;
  }
  cv::Mat area = sheet->image(band);
  area.setTo(sheet->Grey(170, 250));
  for (int x = -height; x < band.width; x += std::max(2, height + sheet->rng->Index(height + 1))) {
    const std::vector<cv::Point> stripe = {
        {x, height}, {x + height / 2, height}, {x + 3 * height / 2, 0}, {x + height, 0}};
    cv::fillPoly(area, std::vector<std::vector<cv::Point>>{stripe}, sheet->Grey(5, 50));
  }
}

void PaintScratch(Sheet* sheet, double length_m) {
  const cv::Point from = sheet->RandomPoint();
  const double angle = sheet->rng->Uniform(0, 2 * M_PI);
  const double length = length_m / sheet->texel_m;
  const cv::Point to(from.x + static_cast<int>(length * std::cos(angle)),
                     from.y + static_cast<int>(length * std::sin(angle)));
  const int grey = sheet->Mark();
  cv::line(sheet->image, from, to, grey, 1 + sheet->rng->Index(2));
}

void PaintSpot(Sheet* sheet, double radius_m) {
  const double flat = sheet->rng->Uniform(0.4, 1);
  const cv::Size axes(sheet->Texels(radius_m), sheet->Texels(radius_m * flat));
  const int thickness = sheet->rng->Chance(0.6) ? cv::FILLED : sheet->Texels(0.2 * radius_m);
  const cv::Point centre = sheet->RandomPoint();
  const double rotation = sheet->rng->Uniform(0, 180);
  cv::ellipse(sheet->image, centre, axes, rotation, 0, 360, sheet->Mark(), thickness);
}

}  // namespace

cv::Mat PaintSheet(double width_m, double height_m, double texel_m, const SheetStyle& style,
                   Rng* rng) {
  const cv::Size size(std::max(4, static_cast<int>(std::ceil(width_m / texel_m))),
                      std::max(4, static_cast<int>(std::ceil(height_m / texel_m))));
  Sheet sheet{BaseCoat(size, style, texel_m, rng), texel_m, style.tone, rng};
  PaintPanels(&sheet, cv::Rect(cv::Point(0, 0), size), style.panel_m);
  // From large to small; the number grows slightly slower than the inverse area.
  for (double scale = 0.5; scale > 3 * texel_m; scale *= 0.45) {
    const double density = style.shapes_per_m2 * std::pow(0.5 / scale, 1.4) * 0.2;
    for (int i = sheet.Count(density); i > 0; --i) {
      const double size_m = scale * rng->Uniform(0.6, 1.4);
      const double kind = rng->Uniform();
      if (kind < 0.40) {
        PaintPolygon(&sheet, 0.5 * size_m);
      } else if (kind < 0.65) {
        PaintLabel(&sheet, 0.6 * size_m);
      } else if (kind < 0.72) {
        PaintStripes(&sheet, 0.6 * size_m);
      } else if (kind < 0.86) {
        PaintSpot(&sheet, 0.3 * size_m);
      } else {
        PaintScratch(&sheet, 2 * size_m);
      }
    }
  }
  return sheet.image;
}

cv::Mat PaintDetail(int size, Rng* rng) {
  cv::Mat noise(size, size, CV_32F, cv::Scalar(128));
  double amplitude = 24;
  for (int cell = 2; cell <= 32; cell *= 2) {
    noise += amplitude * SmoothNoise(noise.size(), cell, rng);
    amplitude *= 0.75;
  }
  cv::Mat image;
  noise.convertTo(image, CV_8U);
  Sheet sheet{image, 1.0, 128, rng};
  const int marks = size * size / 3000;
  for (int i = 0; i < marks; ++i) {
    const double scale = 2.0 * std::pow(10.0, rng->Uniform());
    if (rng->Chance(0.6)) {
      PaintPolygon(&sheet, scale);
    } else if (rng->Chance(0.5)) {
      PaintSpot(&sheet, 0.5 * scale);
    } else {
      PaintScratch(&sheet, 3 * scale);
    }
  }
  return image;
}

}  // namespace pangea::sim
