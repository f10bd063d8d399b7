#pragma once

// Which landmarks of an optimised window do not fit where they are said to be.

#include "vio/window/window_problem.h"

namespace pangea::vio {

bool IsSeenIn(int frame, const Landmark& landmark);
// A ray is far off, or all of them together.
bool IsOutlier(RowViews& rows, const Landmark& landmark);
// Whether its rays pass a chi-square test at 95 %.
bool FitsAsWhole(RowViews& rows, const Landmark& landmark);

}  // namespace pangea::vio
