#pragma once

// A summary of a calibration for people: each value with its uncertainty, and advice.

#include <string>

#include "calibration/calibrate.h"

namespace pangea::calibration {

std::string Summary(const Input& input, const Result& result);

}  // namespace pangea::calibration
