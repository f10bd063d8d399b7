#include "vio/front_end/tracker.h"

#include <algorithm>
#include <cmath>
#include <opencv2/video/tracking.hpp>

namespace pangea::vio {
namespace {

// Decay of the response of the strongest corner from one image to the next.
constexpr double kStrongestKept = 0.98;
// Tracked features may come closer to each other than new ones, down to this share of the distance.
constexpr double kMergeShare = 0.4;

// Features are spread over these cells of the image.
constexpr int kGridColumns = 15;
constexpr int kGridRows = 10;
constexpr double kBorder_px = 8;  // rim of the image without features
// Least value of a corner's smaller eigenvalue: relative to the image's strongest one, and absolute
// (of a contrast-equalised image, OpenCV's units).
constexpr double kQuality = 0.01;
constexpr double kMinEigenvalue = 1e-4;
constexpr double kObservationSigma_px = 0.5;

// While at least this share of the features exists, an empty cell is searched once in kTurns
// images.
constexpr double kEnoughShare = 0.5;
constexpr int kTurns = 3;

constexpr int kKltWindow_px = 21;
constexpr int kKltLevels = 4;  // including the image itself
constexpr int kKltIterations = 20;
constexpr double kKltConverged_px = 0.03;
// Largest distance between a feature and itself tracked back.
constexpr double kMaxForwardBackward_px = 0.7;
// Contrast limit of the histogram equalisation, which gives dark corners of a room features too.
constexpr double kEqualiserClip = 3.0;

Eigen::Vector2d ToEigen(const cv::Point2f& p) { return {p.x, p.y}; }

Eigen::Vector2f ToEigenF(const cv::Point2f& p) { return {p.x, p.y}; }

// Compares squares, as it is called for each pair.
bool Nearer(const cv::Point2f& a, const cv::Point2f& b, double distance_px) {
  return (a - b).ddot(a - b) < distance_px * distance_px;
}

}  // namespace

Tracker::Tracker(const CameraModel& camera, const TrackerOptions& options)
    : camera_(camera), options_(options), equaliser_(kEqualiserClip) {}

void Tracker::Reset() {
  features_.clear();
  last_pyramid_.clear();
  pyramid_.clear();
  next_id_ = 0;
  turn_ = 0;
}

void Tracker::Drop(const std::vector<int32_t>& landmark_ids) {
  std::erase_if(features_, [&](const Feature& feature) {
    return std::find(landmark_ids.begin(), landmark_ids.end(), feature.id) != landmark_ids.end();
  });
}

const TrackedFrame& Tracker::Track(int64_t utime, const cv::Mat& image,
                                   const std::optional<Eigen::Quaterniond>& q_cam_lastcam) {
  statistics_ = {};
  Prepare(image);
  if (!features_.empty()) {
    const std::vector<Bearing> before = Bearings();
    TrackFeatures(image, q_cam_lastcam.value_or(Eigen::Quaterniond::Identity()),
                  1e-6F * static_cast<float>(utime - frame_.utime));
    KeepApart(q_cam_lastcam ? Inliers(*q_cam_lastcam, before)
                            : std::vector<bool>(features_.size(), true));
  }
  statistics_.tracked = static_cast<int>(features_.size());
  AddFeatures();
  TakePatches(image);
  FillFrame(utime);
  return frame_;
}

void Tracker::Prepare(const cv::Mat& image) {
  std::swap(pyramid_, last_pyramid_);
  const cv::Mat equalised = equaliser_.Apply(image);
  pyramid_.clear();
  cv::buildOpticalFlowPyramid(equalised, pyramid_, cv::Size(kKltWindow_px, kKltWindow_px),
                              kKltLevels - 1, true);
}

bool Tracker::Inside(const cv::Point2f& pixel) const {
  return camera_.Contains(ToEigen(pixel), kBorder_px);
}

std::vector<Tracker::Bearing> Tracker::Bearings() const {
  std::vector<Bearing> bearings;
  for (const Feature& feature : features_) {
    bearings.push_back({feature.id, feature.ray});
  }
  return bearings;
}

std::vector<uchar> Tracker::Klt(const Pyramid& from_pyramid, const Pyramid& to_pyramid,
                                const std::vector<cv::Point2f>& from, int coarsest_level,
                                std::vector<cv::Point2f>* to) const {
  std::vector<uchar> ok;
  if (!from.empty()) {
    cv::calcOpticalFlowPyrLK(from_pyramid, to_pyramid, from, *to, ok, cv::noArray(),
                             cv::Size(kKltWindow_px, kKltWindow_px), coarsest_level,
                             cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS,
                                              kKltIterations, kKltConverged_px),
                             cv::OPTFLOW_USE_INITIAL_FLOW);
  }
  return ok;
}

// Tracks from the last image in half size only: the reference patch refines the result. An image
// smaller than KLT's window has no half size.
std::vector<uchar> Tracker::KltNear(std::vector<cv::Point2f> from,
                                    std::vector<cv::Point2f>* to) const {
  if (std::min(pyramid_.size(), last_pyramid_.size()) < 2 * kNearLevel + 2) {
    return Klt(last_pyramid_, pyramid_, from, 0, to);
  }
  const auto half = [](const Pyramid& pyramid) {
    return Pyramid(pyramid.begin() + 2 * kNearLevel, pyramid.begin() + 2 * kNearLevel + 2);
  };
  const auto scale = [](float factor, std::vector<cv::Point2f>* points) {
    for (cv::Point2f& point : *points) {
      point *= factor;
    }
  };
  scale(1.F / (1 << kNearLevel), &from);
  scale(1.F / (1 << kNearLevel), to);
  std::vector<uchar> ok = Klt(half(last_pyramid_), half(pyramid_), from, 0, to);
  scale(1 << kNearLevel, to);
  return ok;
}

// Predicts features by the camera's rotation, and removes those that it takes out of the image.
std::vector<cv::Point2f> Tracker::Rotated(const Eigen::Quaterniond& q_cam_lastcam) {
  std::vector<cv::Point2f> rotated;
  std::erase_if(features_, [&](const Feature& feature) {
    const auto pixel = camera_.Project(q_cam_lastcam * feature.ray.homogeneous());
    if (!pixel || !camera_.Contains(*pixel)) {
      ++statistics_.lost_klt;
      return true;
    }
    rotated.emplace_back(static_cast<float>(pixel->x()), static_cast<float>(pixel->y()));
    return false;
  });
  return rotated;
}

// Finds features that continue their motion and look as they did at first.
std::vector<Tracker::Found> Tracker::FindAsPredicted(const cv::Mat& image,
                                                     const std::vector<cv::Point2f>& rotated,
                                                     float dt_s) {
  std::vector<cv::Point2f> from, to;
  for (size_t i = 0; i < features_.size(); ++i) {
    from.push_back(features_[i].pixel);
    to.push_back(rotated[i] + dt_s * features_[i].flow);
  }
  const std::vector<uchar> ok = KltNear(from, &to);
  std::vector<Found> found(features_.size());
  for (size_t i = 0; i < features_.size(); ++i) {
    if (ok[i] && features_[i].patch) {
      found[i] = features_[i].patch->Find(image, ToEigenF(to[i]));
      statistics_.as_predicted += found[i].has_value();
    }
  }
  return found;
}

// Searches the others nearby, forward and back, and drops those that their patch does not confirm.
void Tracker::FindOthers(const cv::Mat& image, const std::vector<cv::Point2f>& rotated,
                         std::vector<Found>* found) {
  std::vector<size_t> which;
  std::vector<cv::Point2f> from, to;
  for (size_t i = 0; i < features_.size(); ++i) {
    if (!(*found)[i]) {
      which.push_back(i);
      from.push_back(features_[i].pixel);
      to.push_back(rotated[i]);
    }
  }
  const std::vector<uchar> forward_ok = Klt(last_pyramid_, pyramid_, from, kKltLevels - 1, &to);
  // Tracks back with the start as the guess, so that only the finest levels have work to do.
  std::vector<cv::Point2f> back = from;
  const std::vector<uchar> backward_ok = Klt(pyramid_, last_pyramid_, to, kNearLevel, &back);
  for (size_t k = 0; k < which.size(); ++k) {
    Feature& feature = features_[which[k]];
    if (!forward_ok[k]) {
      ++statistics_.lost_klt;
    } else if (!backward_ok[k] || cv::norm(back[k] - from[k]) > kMaxForwardBackward_px) {
      ++statistics_.lost_backward;
    } else {
      const Eigen::Vector2f pixel = ToEigenF(to[k]);
      Found refined = feature.patch ? feature.patch->Find(image, pixel) : std::nullopt;
      if (!refined) {
        feature.patch.reset();
      }
      (*found)[which[k]] = refined ? refined : pixel;
    }
  }
}

void Tracker::TrackFeatures(const cv::Mat& image, const Eigen::Quaterniond& q_cam_lastcam,
                            float dt_s) {
  const std::vector<cv::Point2f> rotated = Rotated(q_cam_lastcam);
  std::vector<Found> found = FindAsPredicted(image, rotated, dt_s);
  FindOthers(image, rotated, &found);
  std::vector<Feature> tracked;
  for (size_t i = 0; i < features_.size(); ++i) {
    if (!found[i]) {
      continue;
    }
    const cv::Point2f pixel((*found[i]).x(), (*found[i]).y());
    const auto ray = camera_.Unproject(found[i]->cast<double>());
    if (!Inside(pixel) || !ray) {
      ++statistics_.lost_klt;
      continue;
    }
    Feature& feature = tracked.emplace_back(std::move(features_[i]));
    feature.flow = (pixel - rotated[i]) / dt_s;
    feature.pixel = pixel;
    feature.ray = *ray;
    if (feature.patch && feature.patch->NeedsReplacement()) {
      feature.patch.reset();
    }
  }
  features_ = std::move(tracked);
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

std::vector<bool> Tracker::Inliers(const Eigen::Quaterniond& q_cam_lastcam,
                                   const std::vector<Bearing>& before) const {
  std::vector<Eigen::Vector2d> rays_before, rays_now;
  size_t at = 0;
  for (const Feature& feature : features_) {
    while (before[at].id != feature.id) {
      ++at;
    }
    rays_before.push_back(before[at].ray);
    rays_now.push_back(feature.ray);
  }
  return CheckTwoView(rays_before, rays_now, q_cam_lastcam, camera_.PixelAngle(), options_.two_view)
      .inlier;
}

// Keeps the inliers. Of two features that have come too close, the older one stays.
void Tracker::KeepApart(const std::vector<bool>& inlier) {
  const double merge_px = kMergeShare * options_.min_distance_px;
  std::vector<Feature> kept;
  for (size_t i = 0; i < features_.size(); ++i) {
    const bool merged = std::any_of(kept.begin(), kept.end(), [&](const Feature& other) {
      return Nearer(other.pixel, features_[i].pixel, merge_px);
    });
    if (inlier[i] && !merged) {
      kept.push_back(std::move(features_[i]));
    } else {
      ++statistics_.lost_two_view;
    }
  }
  features_ = std::move(kept);
}

std::vector<RatedCorner> Tracker::CornersOfEmptyCells() const {
  std::vector<bool> taken(kGridColumns * kGridRows, false);
  for (const Feature& feature : features_) {
    const int column = static_cast<int>(feature.pixel.x) * kGridColumns / camera_.width;
    const int row = static_cast<int>(feature.pixel.y) * kGridRows / camera_.height;
    taken[row * kGridColumns + column] = true;
  }
  const bool in_turns =
      static_cast<double>(features_.size()) > kEnoughShare * options_.max_features;
  // AddFeatures takes no weaker corner.
  const auto least =
      static_cast<float>(std::max(kMinEigenvalue, kQuality * kStrongestKept * strongest_));
  std::vector<RatedCorner> corners;
  for (int row = 0; row < kGridRows; ++row) {
    for (int column = 0; column < kGridColumns; ++column) {
      if (taken[row * kGridColumns + column] ||
          (in_turns && (row + column + turn_) % kTurns != 0)) {
        continue;
      }
      const int x0 = column * camera_.width / kGridColumns;
      const int y0 = row * camera_.height / kGridRows;
      const cv::Rect cell(x0, y0, (column + 1) * camera_.width / kGridColumns - x0,
                          (row + 1) * camera_.height / kGridRows - y0);
      const auto found = FindCorners(pyramid_[1], cell, least);
      corners.insert(corners.end(), found.begin(), found.end());
    }
  }
  std::stable_sort(corners.begin(), corners.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  return corners;
}

void Tracker::AddFeatures() {
  const auto max_features = static_cast<size_t>(options_.max_features);
  if (features_.size() >= max_features) {
    return;
  }
  ++turn_;
  const std::vector<RatedCorner> corners = CornersOfEmptyCells();
  if (!corners.empty()) {
    // The strongest corner of all recent images, because the empty cells alone may be blank.
    strongest_ = std::max(kStrongestKept * strongest_, static_cast<double>(corners.front().first));
  }
  for (const auto& [response, at] : corners) {
    if (features_.size() >= max_features || response < kQuality * strongest_) {
      break;
    }
    const cv::Point2f pixel(at);
    const auto ray = camera_.Unproject(ToEigen(pixel));
    const bool near = std::any_of(features_.begin(), features_.end(), [&](const Feature& f) {
      return Nearer(f.pixel, pixel, options_.min_distance_px);
    });
    if (near || !ray || !Inside(pixel)) {
      continue;
    }
    features_.push_back({next_id_++, pixel, *ray, {}, nullptr});
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
    observation.sigma_px = kObservationSigma_px;
    frame_.observations.push_back(observation);
  }
}

}  // namespace pangea::vio
