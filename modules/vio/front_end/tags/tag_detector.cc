#include "vio/front_end/tags/tag_detector.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

extern "C" {
#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>
}

namespace pangea::vio {
namespace {

constexpr int kMaxWrongBits = 1;
constexpr float kMinDecisionMargin = 25;  // grey values, between bits and their threshold
constexpr double kMinTagSide_px = 16;
// libapriltag counts pixels from the top-left corner of the image, we from the centre of its first
// pixel.
constexpr double kPixelCentre = 0.5;

struct Found {
  TagObservation seen;
  double side_px = 0;  // the shortest
};

Found FoundOf(const apriltag_detection_t& detection) {
  Found found{{{TagFamily::k36h11, detection.id}, {}}, 0};
  double shortest = INFINITY;
  for (int i = 0; i < kTagCorners; ++i) {
    const double* const a = detection.p[i];
    const double* const b = detection.p[(i + 1) % kTagCorners];
    found.seen.corners[static_cast<size_t>(i)] =
        Eigen::Vector2d(a[0] - kPixelCentre, a[1] - kPixelCentre).cast<float>();
    shortest = std::min(shortest, std::hypot(b[0] - a[0], b[1] - a[1]));
  }
  found.side_px = shortest;
  return found;
}

bool IsInside(const TagObservation& seen, const cv::Mat& image) {
  return std::ranges::all_of(seen.corners, [&image](const Eigen::Vector2f& corner) {
    return corner.x() >= 0 && corner.y() >= 0 && corner.x() <= static_cast<float>(image.cols - 1) &&
           corner.y() <= static_cast<float>(image.rows - 1);
  });
}

// The largest ones, by id.
std::vector<TagObservation> Best(const std::map<int, std::vector<Found>>& by_id) {
  std::vector<Found> best;
  for (const auto& [id, found] : by_id) {
    if (found.size() == 1) {
      best.push_back(found.front());
    }
  }
  std::ranges::stable_sort(best, std::greater(), &Found::side_px);
  best.resize(std::min<size_t>(best.size(), kMaxTags));
  std::vector<TagObservation> seen;
  for (const Found& found : best) {
    seen.push_back(found.seen);
  }
  std::ranges::sort(seen, {}, &TagObservation::tag);
  return seen;
}

}  // namespace

struct TagDetector::Library {
  Library() : family(tag36h11_create()), detector(apriltag_detector_create()) {
    detector->nthreads = 1;
    detector->quad_decimate = 2;  // squares are searched in half the size, edges fitted in full
    detector->refine_edges = true;
    apriltag_detector_add_family_bits(detector, family, kMaxWrongBits);
  }
  ~Library() {
    apriltag_detector_destroy(detector);
    tag36h11_destroy(family);
  }
  Library(const Library&) = delete;
  Library& operator=(const Library&) = delete;

  apriltag_family_t* family;
  apriltag_detector_t* detector;
};

TagDetector::TagDetector() : library_(std::make_unique<Library>()) {}
TagDetector::~TagDetector() = default;
TagDetector::TagDetector(TagDetector&&) noexcept = default;
TagDetector& TagDetector::operator=(TagDetector&&) noexcept = default;

std::vector<TagObservation> TagDetector::Detect(const cv::Mat& image) {
  image_u8_t view{image.cols, image.rows, static_cast<int32_t>(image.step), image.data};
  zarray_t* const detections = apriltag_detector_detect(library_->detector, &view);
  std::map<int, std::vector<Found>> by_id;
  for (int i = 0; i < zarray_size(detections); ++i) {
    apriltag_detection_t* detection = nullptr;
    zarray_get(detections, i, &detection);
    const Found found = FoundOf(*detection);
    if (detection->hamming <= kMaxWrongBits && detection->decision_margin >= kMinDecisionMargin &&
        found.side_px >= kMinTagSide_px && IsInside(found.seen, image)) {
      by_id[detection->id].push_back(found);
    }
  }
  apriltag_detections_destroy(detections);
  return Best(by_id);
}

}  // namespace pangea::vio
