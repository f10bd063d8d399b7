#pragma once

// An A4 page with one AprilTag, as SVG.

#include <string>

#include "core/tags/tag.h"

namespace pangea {

// The largest black square that fits on the page with its white border.
inline constexpr double kMaxSheetTag_mm = 160;

// `size_mm`: side of the black square, at most kMaxSheetTag_mm.
std::string TagSheet(const TagId& tag, double size_mm);

}  // namespace pangea
