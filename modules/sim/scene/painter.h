#pragma once

// Paints the sheets of a scene's surfaces: panels, seams and rivets, labels with numbers, warning
// stripes, stains, scratches and shapes of every size, over noise of every scale. All sheets of one
// stream are different.

#include <opencv2/core/mat.hpp>

#include "sim/random.h"

namespace pangea::sim {

struct SheetStyle {
  double tone = 110;         // mean grey
  double panel_m = 1.0;      // typical size of a panel
  double shapes_per_m2 = 6;  // marks of about half a metre; smaller ones are more frequent
  double noise = 24;         // grey values, at the largest scale
  double stain = 70;
};

// 8-bit grey.
cv::Mat PaintSheet(double width_m, double height_m, double texel_m, const SheetStyle& style,
                   Rng* rng);
// A repeating square of fine detail around grey 128; `size` is a power of two.
cv::Mat PaintDetail(int size, Rng* rng);

}  // namespace pangea::sim
