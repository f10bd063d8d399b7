#include "loop_verification/correspondences/epipolar_filter.h"

#include <opencv2/calib3d.hpp>

namespace pangea {

namespace {

// The matches between the corners of the two newest keyframes.
struct CornerPairs {
  std::vector<size_t> matches;    // their indices
  std::vector<cv::Point2d> m, c;  // undistorted pixels of an ideal camera
};

CornerPairs PairsOfNewest(const WindowPair& windows, const std::vector<PointMatch>& matches) {
  CornerPairs pairs;
  for (size_t i = 0; i < matches.size(); ++i) {
    const Window& holder = windows.Holder(matches[i].direction);
    const Window& observer = windows.Observer(matches[i].direction);
    const WindowLandmark& landmark = holder.landmarks[matches[i].landmark];
    if (matches[i].observed.frame != observer.newest() ||
        landmark.observations.back().frame != holder.newest()) {
      continue;
    }
    const Eigen::Vector2d a = holder.frames.back()->ray(landmark.observations.back().corner) /
                              holder.frames.back()->keyframe().camera.PixelAngle();
    const Eigen::Vector2d b = observer.frames.back()->ray(matches[i].observed.corner) /
                              observer.frames.back()->keyframe().camera.PixelAngle();
    const bool forward = matches[i].direction == Direction::kForward;
    pairs.m.emplace_back(forward ? a.x() : b.x(), forward ? a.y() : b.y());
    pairs.c.emplace_back(forward ? b.x() : a.x(), forward ? b.y() : a.y());
    pairs.matches.push_back(i);
  }
  return pairs;
}

}  // namespace

std::vector<PointMatch> FilterByFundamental(const WindowPair& windows,
                                            const std::vector<PointMatch>& matches,
                                            double max_error_px, int min_pairs) {
  const CornerPairs pairs = PairsOfNewest(windows, matches);
  if (static_cast<int>(pairs.matches.size()) < min_pairs) {
    return matches;
  }
  // OpenCV always uses the same seed for this RANSAC.
  std::vector<uchar> inliers;
  constexpr double kConfidence = 0.99;
  constexpr int kMaxIterations = 200;
  const cv::Mat F = cv::findFundamentalMat(pairs.m, pairs.c, cv::FM_RANSAC, max_error_px,
                                           kConfidence, kMaxIterations, inliers);
  if (F.empty()) {
    return matches;
  }
  std::vector<bool> keep(matches.size(), true);
  for (size_t i = 0; i < pairs.matches.size(); ++i) {
    keep[pairs.matches[i]] = inliers[i] != 0;
  }
  std::vector<PointMatch> kept;
  for (size_t i = 0; i < matches.size(); ++i) {
    if (keep[i]) {
      kept.push_back(matches[i]);
    }
  }
  return kept;
}

}  // namespace pangea
