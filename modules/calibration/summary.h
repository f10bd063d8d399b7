#pragma once

// A calibration for people: each value, how sure it is, and what to do better.

#include <string>

#include "calibration/calibrate.h"

namespace pangea::calibration {

std::string Summary(const Input& input, const Result& result);

}  // namespace pangea::calibration
