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

#include "loop_verification/steps/verification.h"

namespace pangea {

// Up to each of the two; not fewer than the window.
inline constexpr int kVisibilityKeyframes = 10;

// First in the two keyframes, then along the way to them.
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

// Looks for the points around the guess in the two keyframes themselves, counts what should be
// there and is not, and refines the guess.
std::string CheckVisibility(const VisibilityOptions& options, Verification* verification);

// The same count along the way to the two keyframes, where more than the object before them is in
// view.
std::string CheckWiderVisibility(const VisibilityOptions& options, Verification* verification);

class VisibilityCount {
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
