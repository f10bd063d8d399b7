#pragma once

// Negative evidence: what ought to be seen in a keyframe, were an alignment right, and is not.
//
// Identical objects at different places align perfectly with each other and with nothing around
// them. So the image is cut into cells, and each cell with points that ought to be found there
// votes: supported where a good share is found; contradicted where none is although, at the rate
// of the supported cells, that is unlikely. A right alignment finds its points all over the shared
// view, at whatever rate corners repeat; a wrong one finds them on the object alone.

#include <map>
#include <vector>

#include "common/alignment/projection_search.h"

namespace pangea {

class Surroundings {
 public:
  // One direction's search in one keyframe.
  void Add(const CameraModel& camera, const SearchResult& result);

  int comparable() const { return comparable_; }  // points that ought to be found
  int found() const { return found_; }
  double found_share() const { return comparable_ == 0 ? 0.0 : double(found_) / comparable_; }
  // Of the cells that tell, the share that supports.
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
