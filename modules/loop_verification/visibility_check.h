#pragma once

// Negative evidence: what ought to be seen in a keyframe, were an alignment right, and is not.
//
// Identical objects at different places align perfectly with each other and with nothing around
// them. A right alignment finds its points all over the shared view, at whatever rate corners
// repeat; a wrong one finds them on the object alone. So the image is cut into cells, and the
// counts of points found in them are explained by a mixture: cells where points are found at one
// common rate, and cells where they are found by chance only. The share of the first kind is what
// counts; it does not depend on how well corners repeat.

#include <vector>

#include "loop_verification/correspondences/projection_search.h"

namespace pangea {

class VisibilityCheck {
 public:
  // One direction's search in one keyframe.
  void Add(const CameraModel& camera, const SearchResult& result);

  int comparable() const { return comparable_; }  // points that ought to be found
  int found() const { return found_; }
  double found_share() const { return comparable_ == 0 ? 0.0 : double(found_) / comparable_; }
  // The share of cells where points are found at the common rate; the rest contradicts, or is
  // hidden.
  double supported_share() const;

 private:
  struct Cell {
    int comparable = 0;
    int found = 0;
  };
  int comparable_ = 0;
  int found_ = 0;
  std::vector<Cell> cells_;
};

// Image cells, 6 x 4.
int ImageCell(const CameraModel& camera, const Eigen::Vector2d& pixel);

}  // namespace pangea
