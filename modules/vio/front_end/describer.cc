#include "vio/front_end/describer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <opencv2/imgproc.hpp>
#include <span>
#include <utility>

#include "vio/front_end/blobs/blobs.h"
#include "vio/front_end/patch_network.h"
#include "vio/front_end/patch_sampler.h"
#include "vio/front_end/spread.h"

namespace pangea::vio {
namespace {

static_assert(kDescriptorBits == 256, "what ORB makes");
// The descriptor's tests reach 15 px from the centre before rotation, 22 after; its patch for the
// angle is a disc of radius 15.
constexpr int kPatchRadius = 15;
constexpr int kBorder = 23;
constexpr float kPatchSize = 31.F;
// Grey levels; the low one is for cells in which the other finds nothing.
constexpr int kFastThreshold = 20;
constexpr int kLowFastThreshold = 7;
// Largest distance, on its octave, from a tracked landmark to the corner at which it is described.
constexpr float kSnapRadius = 2.F;
// Enough to match a keyframe with one 3.6 times as far away (kOctaveScale to the seventh).
constexpr int kOctaves = 8;
// Width of the pixels of the network's patch: of a corner, in pixels of its octave (two octaves
// above, where it is smooth); of a blob, in sigmas.
constexpr double kCornerStep = kOctaveScale * kOctaveScale;
constexpr double kBlobStep = 0.5;
constexpr int kPatchOctaves = 4;  // above those of the corners
constexpr double kRounding = 1 + 1e-6;
constexpr int kCell_px = 40;  // corners are spread over cells of this size, on each octave

// Half width of each row of the disc. By the rounding, the disc is only nearly the same in both
// directions.
std::array<int, kPatchRadius + 1> DiscHalfWidths() {
  std::array<int, kPatchRadius + 1> widths{};
  for (int v = 0; v <= kPatchRadius; ++v) {
    widths[v] = static_cast<int>(std::lround(std::sqrt(kPatchRadius * kPatchRadius - v * v)));
  }
  return widths;
}

// A receiver that takes only the first of them gets some of each.
void Alternate(std::span<const Corner> a, std::span<const Corner> b, std::vector<Corner>* out) {
  for (size_t i = 0; i < std::max(a.size(), b.size()); ++i) {
    for (const auto& list : {a, b}) {
      if (i < list.size()) {
        out->push_back(list[i]);
      }
    }
  }
}

std::vector<Corner> WithNetwork(std::vector<Corner> corners,
                                const std::vector<PatchNetwork::Patch>& patches) {
  const std::vector<Descriptor> descriptors = PatchNetwork::BuiltIn().Describe(patches);
  for (size_t i = 0; i < corners.size(); ++i) {
    corners[i].descriptor = descriptors[i];
  }
  return corners;
}

}  // namespace

Describer::Describer(const CameraModel& camera, const DescriberOptions& options)
    : camera_(camera),
      options_(options),
      // With one level ORB takes the corners of a given octave as they are.
      orb_(cv::ORB::create(1, static_cast<float>(kOctaveScale), 1, kPatchRadius, 0, 2)) {
  for (int octave = 0; octave < kOctaves; ++octave) {
    scales_.push_back(std::pow(kOctaveScale, octave));
  }
}

void Describer::BuildPyramid(const cv::Mat& image) {
  pyramid_.resize(scales_.size() + kPatchOctaves);
  strong_.resize(scales_.size());
  pyramid_[0] = image;
  for (size_t octave = 1; octave < pyramid_.size(); ++octave) {
    const double scale = std::pow(kOctaveScale, octave);
    const cv::Size size(static_cast<int>(std::lround(image.cols / scale)),
                        static_cast<int>(std::lround(image.rows / scale)));
    cv::resize(pyramid_[octave - 1], pyramid_[octave], size, 0, 0, cv::INTER_LINEAR_EXACT);
  }
  for (size_t octave = 0; octave < scales_.size(); ++octave) {
    cv::FAST(pyramid_[octave], strong_[octave], kFastThreshold, true);
  }
}

// Finds corners in a part of an octave with the low threshold. FAST looks 3 px around a pixel, and
// compares the responses of neighbours.
std::vector<cv::KeyPoint> Describer::WeakCorners(int octave, const cv::Rect& part) const {
  constexpr int kReach = 4;
  const cv::Mat& level = pyramid_[octave];
  const cv::Rect around = cv::Rect(part.x - kReach, part.y - kReach, part.width + 2 * kReach,
                                   part.height + 2 * kReach) &
                          cv::Rect({0, 0}, level.size());
  std::vector<cv::KeyPoint> found;
  cv::FAST(level(around), found, kLowFastThreshold, true);
  for (cv::KeyPoint& corner : found) {
    corner.pt += cv::Point2f(around.tl());
  }
  std::erase_if(found,
                [&](const cv::KeyPoint& corner) { return !part.contains(cv::Point(corner.pt)); });
  return found;
}

std::vector<Describer::Candidate> Describer::FindCorners(int octave, int wanted) const {
  const cv::Mat& level = pyramid_[octave];
  const cv::Rect inside(kBorder, kBorder, level.cols - 2 * kBorder, level.rows - 2 * kBorder);
  const int columns = (level.cols + kCell_px - 1) / kCell_px;
  const int rows = (level.rows + kCell_px - 1) / kCell_px;
  std::vector<cv::KeyPoint> corners = strong_[octave];
  // A cell with strong corners keeps only those.
  std::vector<bool> has_strong(static_cast<size_t>(columns) * rows, false);
  for (const cv::KeyPoint& corner : corners) {
    has_strong[static_cast<size_t>(corner.pt.y) / kCell_px * columns +
               static_cast<size_t>(corner.pt.x) / kCell_px] = true;
  }
  for (int cell = 0; cell < columns * rows; ++cell) {
    const cv::Rect part =
        cv::Rect(cell % columns * kCell_px, cell / columns * kCell_px, kCell_px, kCell_px) & inside;
    if (!has_strong[cell] && !part.empty()) {
      const std::vector<cv::KeyPoint> weak = WeakCorners(octave, part);
      corners.insert(corners.end(), weak.begin(), weak.end());
    }
  }
  std::vector<Candidate> candidates;
  for (const cv::KeyPoint& corner : corners) {
    if (inside.contains(cv::Point(corner.pt))) {
      Candidate candidate;
      candidate.level_pixel = corner.pt;
      candidate.octave = octave;
      candidate.response = corner.response;
      candidates.push_back(candidate);
    }
  }
  // Sorted row by row, as corners of equal response are chosen in this order.
  std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
    return std::pair(a.level_pixel.y, a.level_pixel.x) <
           std::pair(b.level_pixel.y, b.level_pixel.x);
  });
  return SpreadOver(std::move(candidates), &Candidate::level_pixel, kCell_px, level.cols,
                    static_cast<size_t>(wanted));
}

float Describer::StrongestNear(const std::vector<cv::KeyPoint>& corners,
                               const cv::Point2f& level_pixel, cv::Point2f* at) {
  auto corner = std::lower_bound(corners.begin(), corners.end(), level_pixel.y - kSnapRadius,
                                 [](const cv::KeyPoint& one, float y) { return one.pt.y < y; });
  float best = 0;
  for (; corner != corners.end() && corner->pt.y <= level_pixel.y + kSnapRadius; ++corner) {
    if (corner->response > best && cv::norm(corner->pt - level_pixel) <= kSnapRadius) {
      best = corner->response;
      *at = corner->pt;
    }
  }
  return best;
}

// Places it on the octave where it is the strongest corner; returns nothing if too close to the
// rim.
std::optional<Describer::Candidate> Describer::Place(const Eigen::Vector2f& pixel,
                                                     bool weak_too) const {
  std::optional<Candidate> best;
  for (int octave = 0; octave < static_cast<int>(scales_.size()); ++octave) {
    const cv::Point2f level_pixel = ToLevel(octave, pixel);
    const cv::Mat& level = pyramid_[octave];
    if (level_pixel.x < kBorder || level_pixel.y < kBorder ||
        level_pixel.x >= static_cast<float>(level.cols - kBorder) ||
        level_pixel.y >= static_cast<float>(level.rows - kBorder)) {
      break;  // coarser levels only come closer to the rim
    }
    cv::Point2f at = level_pixel;
    constexpr int kReach = static_cast<int>(kSnapRadius);
    const cv::Rect near(static_cast<int>(level_pixel.x) - kReach,
                        static_cast<int>(level_pixel.y) - kReach, 2 * kReach + 2, 2 * kReach + 2);
    const float strength = weak_too ? StrongestNear(WeakCorners(octave, near), level_pixel, &at)
                                    : StrongestNear(strong_[octave], level_pixel, &at);
    if (!best || strength > best->response) {
      best.emplace();
      best->octave = octave;
      best->level_pixel = at;
      best->response = strength;
      best->pixel = pixel;
    }
  }
  return best;
}

std::vector<Describer::Candidate> Describer::PlaceLandmarks(const TrackedFrame& frame) const {
  std::vector<Candidate> candidates;
  for (const Observation& observation : frame.observations) {
    auto placed = Place(observation.pixel, false);
    if (placed && placed->response == 0) {
      placed = Place(observation.pixel, true);
    }
    if (placed) {
      placed->landmark_id = observation.landmark_id;
      candidates.push_back(*placed);
    }
  }
  return candidates;
}

// Pixel centres: (0, 0) is the middle of the top-left pixel on each octave; the real scale differs
// from the nominal one because sizes are whole pixels.
cv::Point2f Describer::ToLevel(int octave, const Eigen::Vector2f& pixel) const {
  const cv::Mat& level = pyramid_[octave];
  const cv::Mat& image = pyramid_[0];
  return {
      (pixel.x() + 0.5F) * static_cast<float>(level.cols) / static_cast<float>(image.cols) - 0.5F,
      (pixel.y() + 0.5F) * static_cast<float>(level.rows) / static_cast<float>(image.rows) - 0.5F};
}

Eigen::Vector2f Describer::ToImage(int octave, const cv::Point2f& level_pixel) const {
  const cv::Mat& level = pyramid_[octave];
  const cv::Mat& image = pyramid_[0];
  return {(level_pixel.x + 0.5F) * static_cast<float>(image.cols) / static_cast<float>(level.cols) -
              0.5F,
          (level_pixel.y + 0.5F) * static_cast<float>(image.rows) / static_cast<float>(level.rows) -
              0.5F};
}

// Rublee et al., eq. 1-3: the direction from the corner to the intensity centroid of a disc.
float Describer::Angle(int octave, const cv::Point2f& level_pixel) const {
  static const std::array<int, kPatchRadius + 1> kHalfWidth = DiscHalfWidths();
  const cv::Mat& level = pyramid_[octave];
  const int x0 = cvRound(level_pixel.x);
  const int y0 = cvRound(level_pixel.y);
  int m10 = 0, m01 = 0;
  for (int v = -kPatchRadius; v <= kPatchRadius; ++v) {
    const uchar* row = level.ptr<uchar>(y0 + v);
    const int half = kHalfWidth[std::abs(v)];
    int sum = 0;
    for (int u = -half; u <= half; ++u) {
      m10 += u * row[x0 + u];
      sum += row[x0 + u];
    }
    m01 += v * sum;
  }
  return cv::fastAtan2(static_cast<float>(m01), static_cast<float>(m10));
}

Corner Describer::ToCorner(const Candidate& candidate) const {
  Corner corner;
  corner.octave = static_cast<int8_t>(candidate.octave);
  corner.landmark_id = candidate.landmark_id;
  corner.pixel = candidate.landmark_id != kNoLandmark
                     ? candidate.pixel
                     : ToImage(candidate.octave, candidate.level_pixel);
  return corner;
}

// It is sampled from the coarsest octave that is not coarser than the patch.
PatchNetwork::Patch Describer::PatchAt(const Eigen::Vector2f& pixel, double step_px,
                                       const PatchSampler& sampler) const {
  int octave = 0;
  double scale = 1;
  while (octave + 1 < static_cast<int>(pyramid_.size()) &&
         scale * kOctaveScale <= step_px * kRounding) {
    scale *= kOctaveScale;
    ++octave;
  }
  const double step = std::max(step_px, 1.0) * pyramid_[octave].cols / pyramid_[0].cols;
  return sampler.Sample(pyramid_[octave], ToLevel(octave, pixel), step);
}

std::vector<Corner> Describer::DescribeCorners(const std::vector<Candidate>& candidates,
                                               const Eigen::Vector3d& down_cam) const {
  if (options_.descriptor == DescriptorKind::kOrb) {
    return ComputeOrb(candidates);
  }
  const PatchSampler sampler(down_cam);
  std::vector<Corner> corners;
  std::vector<PatchNetwork::Patch> patches;
  for (const Candidate& candidate : candidates) {
    corners.push_back(ToCorner(candidate));
    patches.push_back(PatchAt(ToImage(candidate.octave, candidate.level_pixel),
                              kCornerStep * scales_[candidate.octave], sampler));
  }
  return WithNetwork(std::move(corners), patches);
}

std::vector<Corner> Describer::DescribeBlobs(const cv::Mat& image, int wanted,
                                             const Eigen::Vector3d& down_cam) const {
  if (options_.descriptor == DescriptorKind::kOrb) {
    return vio::DescribeBlobs(image, wanted, kCell_px);
  }
  const PatchSampler sampler(down_cam);
  std::vector<Corner> corners;
  std::vector<PatchNetwork::Patch> patches;
  for (const FoundBlob& blob : FindBlobs(image, wanted, kCell_px)) {
    corners.push_back(blob.corner);
    patches.push_back(PatchAt(blob.corner.pixel, kBlobStep * blob.sigma_px, sampler));
  }
  return WithNetwork(std::move(corners), patches);
}

std::vector<Corner> Describer::ComputeOrb(const std::vector<Candidate>& candidates) const {
  std::vector<Corner> corners(candidates.size());
  std::vector<cv::KeyPoint> keypoints;
  for (size_t octave = 0; octave < scales_.size(); ++octave) {
    keypoints.clear();
    for (size_t i = 0; i < candidates.size(); ++i) {
      if (candidates[i].octave == static_cast<int>(octave)) {
        keypoints.emplace_back(candidates[i].level_pixel, kPatchSize,
                               Angle(candidates[i].octave, candidates[i].level_pixel),
                               candidates[i].response, 0, static_cast<int>(i));
      }
    }
    if (keypoints.empty()) {
      continue;
    }
    cv::Mat descriptors;
    orb_->compute(pyramid_[octave], keypoints, descriptors);
    for (int row = 0; row < descriptors.rows; ++row) {
      const Candidate& candidate = candidates[static_cast<size_t>(keypoints[row].class_id)];
      Corner& corner = corners[static_cast<size_t>(keypoints[row].class_id)];
      corner = ToCorner(candidate);
      std::memcpy(corner.descriptor.data(), descriptors.ptr(row), sizeof(Descriptor));
    }
  }
  return corners;
}

// The octaves share the wanted number in proportion to their side length.
std::vector<Describer::Candidate> Describer::FindCorners(int wanted) const {
  double share_sum = 0;
  for (const double scale : scales_) {
    share_sum += 1.0 / scale;
  }
  std::vector<Candidate> corners;
  double carried_over = 0;  // number that the coarser octaves did not use; the finer ones get it
  for (int octave = static_cast<int>(scales_.size()) - 1; octave >= 0; --octave) {
    carried_over += wanted / scales_[octave] / share_sum;
    const auto found =
        FindCorners(octave, std::max(0, static_cast<int>(std::lround(carried_over))));
    carried_over -= static_cast<double>(found.size());
    corners.insert(corners.end(), found.begin(), found.end());
  }
  return corners;
}

std::vector<Corner> Describer::Describe(const cv::Mat& image, const TrackedFrame& frame,
                                        const Eigen::Vector3d& down_cam) {
  BuildPyramid(image);
  std::vector<Candidate> candidates = PlaceLandmarks(frame);
  candidates.resize(std::min(candidates.size(), size_t{kMaxCorners}));
  const auto num_landmarks = static_cast<std::ptrdiff_t>(candidates.size());
  const int left = kMaxCorners - static_cast<int>(num_landmarks);
  const std::vector<Corner> blobs =
      DescribeBlobs(image, std::min(options_.max_blobs, left), down_cam);
  const size_t num_others = static_cast<size_t>(left) - blobs.size();
  const std::vector<Candidate> others = FindCorners(static_cast<int>(num_others));
  candidates.insert(
      candidates.end(), others.begin(),
      others.begin() + static_cast<std::ptrdiff_t>(std::min(others.size(), num_others)));
  const std::vector<Corner> described = DescribeCorners(candidates, down_cam);
  std::vector<Corner> corners(described.begin(), described.begin() + num_landmarks);
  Alternate(std::span(described).subspan(static_cast<size_t>(num_landmarks)), blobs, &corners);
  return corners;
}

}  // namespace pangea::vio
