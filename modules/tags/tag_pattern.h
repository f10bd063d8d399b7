#pragma once

// What is printed of an AprilTag. From libapriltag: OpenCV 4.6 draws the same family rotated by 180
// degrees.

#include <vector>

#include "core/tags/tag.h"

namespace pangea {

struct TagPattern {
  // Side of the whole pattern with its white border, and of the black square, in cells.
  int cells = 0;
  int square_cells = 0;
  std::vector<bool> white;  // row by row from the top

  bool IsWhite(int row, int column) const {
    return white[static_cast<size_t>(row * cells + column)];
  }
};

// `tag`: its id must be one of its family.
TagPattern PatternOf(const TagId& tag);

}  // namespace pangea
