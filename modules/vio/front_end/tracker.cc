#include "vio/front_end/tracker.h"

#include <algorithm>
#include <cmath>
#include <opencv2/video/tracking.hpp>

namespace pangea::vio {
namespace {

constexpr int kEqualizeTiles = 8;
constexpr int kCornerBlock_px = 5;
// Features may come closer to each other while tracked than they were found, down to this share.
constexpr double kMergeShare = 0.4;

Eigen::Vector2d ToEigen(const cv::Point2f& p) { return {p.x, p.y}; }

Eigen::Vector2f ToEigenF(const cv::Point2f& p) { return {p.x, p.y}; }

}  // namespace

Tracker::Tracker(const CameraModel& camera, const TrackerOptions& options)
    : camera_(camera), options_(options) {
  if (options_.equalize) {
    equalizer_ = cv::createCLAHE(options_.equalize_clip, cv::Size(kEqualizeTiles, kEqualizeTiles));
  }
}

void Tracker::Reset() {
  features_.clear();
  last_pyramid_.clear();
  pyramid_.clear();
  next_id_ = 0;
}

void Tracker::Drop(const std::vector<int32_t>& landmark_ids) {
  std::erase_if(features_, [&](const Feature& feature) {
    return std::find(landmark_ids.begin(), landmark_ids.end(), feature.id) != landmark_ids.end();
  });
}

const TrackedFrame& Tracker::Track(int64_t utime, const cv::Mat& image,
                                   const Eigen::Quaterniond& q_cam_lastcam) {
  statistics_ = {};
  Prepare(image);
  if (!features_.empty()) {
    const std::vector<Bearing> before = Bearings();
    TrackFeatures(q_cam_lastcam);
    RefineWithPatches(image);
    RejectOutliers(q_cam_lastcam, before);
  }
  statistics_.tracked = static_cast<int>(features_.size());
  AddFeatures();
  TakePatches(image);
  FillFrame(utime);
  return frame_;
}

void Tracker::Prepare(const cv::Mat& image) {
  std::swap(pyramid_, last_pyramid_);
  cv::Mat prepared = image;
  if (equalizer_) {
    cv::Mat equalized;  // its own memory: the caller keeps the image
    equalizer_->apply(image, equalized);
    prepared = equalized;
  }
  pyramid_.clear();
  cv::buildOpticalFlowPyramid(prepared, pyramid_, cv::Size(options_.window_px, options_.window_px),
                              options_.pyramid_levels - 1, true);
}

bool Tracker::Inside(const cv::Point2f& pixel) const {
  return camera_.Contains(ToEigen(pixel), options_.border_px);
}

std::vector<Tracker::Bearing> Tracker::Bearings() const {
  std::vector<Bearing> bearings;
  for (const Feature& feature : features_) {
    bearings.push_back({feature.id, feature.ray});
  }
  return bearings;
}

void Tracker::TrackFeatures(const Eigen::Quaterniond& q_cam_lastcam) {
  std::vector<Feature> predicted;
  std::vector<cv::Point2f> from, to;
  for (Feature& feature : features_) {
    const auto pixel = camera_.Project(q_cam_lastcam * feature.ray.homogeneous());
    if (!pixel || !camera_.Contains(*pixel)) {
      ++statistics_.lost_klt;
      continue;
    }
    from.push_back(feature.pixel);
    to.emplace_back(static_cast<float>(pixel->x()), static_cast<float>(pixel->y()));
    predicted.push_back(std::move(feature));
  }
  features_.clear();
  if (predicted.empty()) {
    return;
  }
  const cv::Size window(options_.window_px, options_.window_px);
  const cv::TermCriteria stop(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 20, 0.01);
  std::vector<uchar> forward_ok, backward_ok;
  std::vector<float> error;
  cv::calcOpticalFlowPyrLK(last_pyramid_, pyramid_, from, to, forward_ok, error, window,
                           options_.pyramid_levels - 1, stop, cv::OPTFLOW_USE_INITIAL_FLOW);
  // Back from the result with the start as the guess: only the finest levels have work to do.
  std::vector<cv::Point2f> back = from;
  cv::calcOpticalFlowPyrLK(pyramid_, last_pyramid_, to, back, backward_ok, error, window, 1, stop,
                           cv::OPTFLOW_USE_INITIAL_FLOW);
  for (size_t i = 0; i < predicted.size(); ++i) {
    const auto ray = camera_.Unproject(ToEigen(to[i]));
    if (!forward_ok[i] || !Inside(to[i]) || !ray) {
      ++statistics_.lost_klt;
    } else if (!backward_ok[i] || cv::norm(back[i] - from[i]) > options_.max_forward_backward_px) {
      ++statistics_.lost_backward;
    } else {
      Feature& feature = predicted[i];
      feature.pixel = to[i];
      feature.ray = *ray;
      features_.push_back(std::move(feature));
    }
  }
}

// Image-to-image tracking has brought each feature to within a pixel or so.
void Tracker::RefineWithPatches(const cv::Mat& image) {
  for (Feature& feature : features_) {
    if (!feature.patch) {
      continue;
    }
    const auto found = feature.patch->Find(image, ToEigenF(feature.pixel));
    const auto ray = found ? camera_.Unproject(found->cast<double>()) : std::nullopt;
    if (ray) {
      feature.pixel = {found->x(), found->y()};
      feature.ray = *ray;
    }
    if (!ray || feature.patch->IsWornOut()) {
      feature.patch.reset();
    }
  }
}

void Tracker::TakePatches(const cv::Mat& image) {
  for (Feature& feature : features_) {
    if (!feature.patch) {
      if (const auto patch = ReferencePatch::Take(image, ToEigenF(feature.pixel))) {
        feature.patch = std::make_unique<ReferencePatch>(*patch);
      }
    }
  }
}

void Tracker::RejectOutliers(const Eigen::Quaterniond& q_cam_lastcam,
                             const std::vector<Bearing>& before) {
  std::vector<Eigen::Vector2d> rays_before, rays_now;
  size_t at = 0;
  for (const Feature& feature : features_) {
    while (before[at].id != feature.id) {
      ++at;
    }
    rays_before.push_back(before[at].ray);
    rays_now.push_back(feature.ray);
  }
  const TwoViewResult check =
      CheckTwoView(rays_before, rays_now, q_cam_lastcam, camera_.PixelAngle(), options_.two_view);
  // The older of two features that have run together stays.
  const double merge_px = kMergeShare * options_.min_distance_px;
  std::vector<Feature> kept;
  for (size_t i = 0; i < features_.size(); ++i) {
    const bool merged = std::any_of(kept.begin(), kept.end(), [&](const Feature& other) {
      return cv::norm(other.pixel - features_[i].pixel) < merge_px;
    });
    if (check.inlier[i] && !merged) {
      kept.push_back(std::move(features_[i]));
    } else {
      ++statistics_.lost_two_view;
    }
  }
  features_ = std::move(kept);
}

std::vector<std::pair<float, cv::Point>> Tracker::FindCorners(const cv::Rect& cell) const {
  // Level 0 of the pyramid is a view into a larger image with a border, so that the filters see the
  // true neighbourhood of the cell.
  cv::Mat response;
  cv::cornerMinEigenVal(pyramid_[0](cell), response, kCornerBlock_px, 3);
  std::vector<std::pair<float, cv::Point>> corners;
  for (int y = 1; y + 1 < response.rows; ++y) {
    const float* above = response.ptr<float>(y - 1);
    const float* row = response.ptr<float>(y);
    const float* below = response.ptr<float>(y + 1);
    for (int x = 1; x + 1 < response.cols; ++x) {
      const float r = row[x];
      if (r >= options_.min_eigenvalue && r > row[x - 1] && r >= row[x + 1] &&
          r > std::max({above[x - 1], above[x], above[x + 1]}) &&
          r >= std::max({below[x - 1], below[x], below[x + 1]})) {
        corners.emplace_back(r, cv::Point(cell.x + x, cell.y + y));
      }
    }
  }
  return corners;
}

void Tracker::AddFeatures() {
  const int wanted = options_.max_features - static_cast<int>(features_.size());
  if (wanted <= 0) {
    return;
  }
  const int columns = options_.grid_columns;
  const int rows = options_.grid_rows;
  std::vector<bool> taken(columns * rows, false);
  for (const Feature& feature : features_) {
    const int column = static_cast<int>(feature.pixel.x) * columns / camera_.width;
    const int row = static_cast<int>(feature.pixel.y) * rows / camera_.height;
    taken[row * columns + column] = true;
  }
  std::vector<std::pair<float, cv::Point>> corners;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      if (taken[row * columns + column]) {
        continue;
      }
      const int x0 = column * camera_.width / columns;
      const int y0 = row * camera_.height / rows;
      const cv::Rect cell(x0, y0, (column + 1) * camera_.width / columns - x0,
                          (row + 1) * camera_.height / rows - y0);
      const auto found = FindCorners(cell);
      corners.insert(corners.end(), found.begin(), found.end());
    }
  }
  std::stable_sort(corners.begin(), corners.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  if (!corners.empty()) {
    // The image's strongest corner, over all recent images: the empty cells alone may be blank.
    strongest_ = std::max(0.98 * strongest_, static_cast<double>(corners.front().first));
  }
  for (const auto& [response, at] : corners) {
    if (static_cast<int>(features_.size()) >= options_.max_features ||
        response < options_.quality * strongest_) {
      break;
    }
    const cv::Point2f pixel(at);
    const auto ray = camera_.Unproject(ToEigen(pixel));
    const bool near = std::any_of(features_.begin(), features_.end(), [&](const Feature& f) {
      return cv::norm(f.pixel - pixel) < options_.min_distance_px;
    });
    if (near || !ray || !Inside(pixel)) {
      continue;
    }
    features_.push_back({next_id_++, pixel, *ray, nullptr});
    ++statistics_.added;
  }
}

void Tracker::FillFrame(int64_t utime) {
  frame_.utime = utime;
  frame_.observations.clear();
  for (const Feature& feature : features_) {
    Observation observation;
    observation.landmark_id = feature.id;
    observation.pixel = {feature.pixel.x, feature.pixel.y};
    observation.ray = feature.ray;
    observation.sigma_px = options_.sigma_px;
    frame_.observations.push_back(observation);
  }
}

}  // namespace pangea::vio
