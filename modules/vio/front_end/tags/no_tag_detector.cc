// In place of tag_detector.cc where libapriltag is missing: in the agent for browsers.

#include "vio/front_end/tags/tag_detector.h"

namespace pangea::vio {

struct TagDetector::Library {};

TagDetector::TagDetector() = default;
TagDetector::~TagDetector() = default;
TagDetector::TagDetector(TagDetector&&) noexcept = default;
TagDetector& TagDetector::operator=(TagDetector&&) noexcept = default;

std::vector<TagObservation> TagDetector::Detect(const cv::Mat& /*image*/) { return {}; }

}  // namespace pangea::vio
