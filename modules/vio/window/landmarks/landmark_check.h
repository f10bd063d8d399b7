#pragma once

// Finds the landmarks of an optimised window that do not fit their rays.

#include "vio/window/window_problem.h"

namespace pangea::vio {

bool IsSeenIn(int frame, const Landmark& landmark);
// True if one ray, or all rays together, have a large error.
bool IsOutlier(RowViews& rows, const Landmark& landmark);
// Whether its rays pass a chi-square test at 95 %.
bool FitsAsWhole(RowViews& rows, const Landmark& landmark);

}  // namespace pangea::vio
