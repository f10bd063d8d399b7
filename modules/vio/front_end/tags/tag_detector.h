#pragma once

// Finds AprilTags in an image, by libapriltag (Wang & Olson, IROS 2016). Deterministic; one thread.

#include <memory>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "core/tags/tag.h"

namespace pangea::vio {

class TagDetector {
 public:
  TagDetector();
  ~TagDetector();
  TagDetector(TagDetector&&) noexcept;
  TagDetector& operator=(TagDetector&&) noexcept;

  // `image`: 8-bit grey. The tags by id, at most kMaxTags: the largest ones. One that is there
  // twice is left out, and so is one with sides under 16 pixels, whose corners tell little.
  std::vector<TagObservation> Detect(const cv::Mat& image);

 private:
  struct Library;
  std::unique_ptr<Library> library_;
};

}  // namespace pangea::vio
