#pragma once

// Negative evidence: points that should be visible in a keyframe if an alignment is right, but are
// not found.
//
// Identical objects at different places align perfectly with each other, but the scenes around them
// do not. A correct alignment finds points all over the common view, at the rate at which corners
// repeat; a wrong one finds points only on the object. So the image is divided into cells, and the
// numbers of points found in them are modelled as a mixture: in some cells points are found at one
// common rate, in the others only by chance. The share of cells of the first kind is tested; it
// does not depend on how well corners repeat.

#include <vector>

#include "loop_verification/steps/verification.h"

namespace pangea {

// Number of keyframes up to each of the two; not fewer than in a window.
inline constexpr int kVisibilityKeyframes = 10;

// The first four apply to the two keyframes, the last one to the keyframes on the way to them.
struct VisibilityOptions {
  int min_found = 10;
  int min_comparable = 15;
  double min_found_share = 0.08;
  double min_first_supported_share = 0.3;
  double min_supported_share = 0.55;

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("min_found", &min_found, {0, 100000}, "", "points found in the two keyframes");
    archive.Add("min_comparable", &min_comparable, {0, 100000}, "",
                "points that ought to be seen in the two keyframes");
    archive.Add("min_found_share", &min_found_share, {0, 1}, "",
                "of the points that ought to be seen");
    archive.Add("min_first_supported_share", &min_first_supported_share, {0, 1}, "",
                "of the view, in the two keyframes");
    archive.Add("min_supported_share", &min_supported_share, {0, 1}, "",
                "of the view, along the way to them");
  }
};

// Searches the points in the two keyframes themselves near their predicted positions, counts those
// that should be visible but are not found, and refines the pose.
std::string CheckVisibility(const VisibilityOptions& options, Verification* verification);

// The same count in the keyframes on the way to the two, whose views show more than the object
// alone.
std::string CheckWiderVisibility(const VisibilityOptions& options, Verification* verification);

class VisibilityCount {
 public:
  // Adds the result of one search in one keyframe.
  void Add(const CameraModel& camera, const SearchResult& result);

  int comparable() const { return comparable_; }  // points that should be found
  int found() const { return found_; }
  double found_share() const { return comparable_ == 0 ? 0.0 : double(found_) / comparable_; }
  // The share of cells in which points are found at the common rate; the others contradict the
  // alignment, or are occluded.
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

// Index of the image cell (6 x 4) of a pixel.
int ImageCell(const CameraModel& camera, const Eigen::Vector2d& pixel);

}  // namespace pangea
