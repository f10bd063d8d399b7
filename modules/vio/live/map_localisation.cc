#include "vio/live/map_localisation.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace pangea::vio {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kMinSearchDepth = 0.2;  // m
constexpr double kBorder_px = 5;
// Maximum number of source keyframes in one alignment: each adds four unknowns.
constexpr size_t kMaxSources = 32;

Eigen::Matrix4d PositionAndYaw(const Matrix6d& covariance) {
  const std::array rows = {0, 1, 2, 5};
  return covariance(rows, rows);
}

}  // namespace

void MapLocalisation::Reset(const MapId& map) {
  const Counters counters = counters_;
  *this = MapLocalisation(MapLocalisationOptions(options_));
  counters_ = counters;
  map_ = map;
}

bool MapLocalisation::Correct(const Correction& correction) {
  if (correction.map != map_ || (correction_ && correction.revision <= correction_->revision)) {
    return false;
  }
  if (correction_ && correction_->group != correction.group) {
    known_.clear();
    matches_.clear();
    localized_.reset();
  }
  correction_ = correction;
  return true;
}

bool MapLocalisation::Take(const MapLandmarks& landmarks) {
  if (!correction_ || landmarks.map != map_ || landmarks.group != correction_->group) {
    return false;
  }
  ++arrivals_;
  for (const MapLandmark& landmark : landmarks.landmarks) {
    const MapLandmarks::Source& source = landmarks.sources[landmark.source];
    const Vector3d along = (landmark.p_map - source.p_map_cam).normalized();
    const double across = landmark.sigma_across_m * landmark.sigma_across_m;
    const double more = landmark.sigma_along_m * landmark.sigma_along_m - across;
    known_[{source.keyframe.map, landmark.landmark_id}] = {
        source.keyframe,     source.p_map_cam,
        landmark.p_map,      across * Matrix3d::Identity() + more * along * along.transpose(),
        landmark.descriptor, arrivals_};
  }
  ForgetOldest();
  return true;
}

void MapLocalisation::ForgetOldest() {
  while (known_.size() > kMaxLandmarks) {
    known_.erase(std::min_element(known_.begin(), known_.end(), [](const auto& a, const auto& b) {
      return a.second.arrival < b.second.arrival;
    }));
  }
}

void MapLocalisation::NotePublished(const Keyframe& keyframe) {
  published_.push_back({keyframe.id.seq, keyframe.utime, keyframe.T_odom_body, keyframe.edge});
  if (published_.size() > kMaxPublished) {
    published_.pop_front();
  }
}

// Propagates the correction's covariance from the correction's keyframe along the odometry edges to
// the window's first pose.
std::optional<LocalizationPrior> MapLocalisation::PriorAt(const WindowPoses& window) const {
  const auto at = std::find_if(published_.begin(), published_.end(),
                               [&](const Published& p) { return p.seq == correction_->seq; });
  if (at == published_.end()) {
    return std::nullopt;
  }
  const Rigid3& T_map_odom = correction_->T_map_odom;
  Matrix6d covariance =
      ComposeCovariance(T_map_odom, correction_->covariance, at->T_odom_body, Matrix6d::Zero());
  Rigid3 T_map_body = T_map_odom * at->T_odom_body;
  for (auto next = at + 1;
       next != published_.end() && next->edge && next->utime <= window.utimes.front(); ++next) {
    covariance =
        ComposeCovariance(T_map_body, covariance, next->edge->T_from_this, next->edge->covariance);
    T_map_body = T_map_odom * next->T_odom_body;
  }
  return LocalizationPrior{T_map_odom, PositionAndYaw(covariance)};
}

// For each landmark, the corner with the nearest descriptor around its predicted position; a corner
// is matched to one landmark at most.
std::vector<MapLocalisation::Match> MapLocalisation::FindIn(const CameraModel& camera,
                                                            const std::vector<Corner>& corners,
                                                            const MatchingOptions& matching,
                                                            const Rigid3& T_map_cam) const {
  const CornerGrid grid(corners);
  const Rigid3 T_cam_map = T_map_cam.Inverse();
  std::map<int, std::pair<int, LandmarkKey>> nearest;  // by corner: (distance, landmark)
  for (const auto& [key, known] : known_) {
    const Vector3d p_cam = T_cam_map * known.p_map;
    const auto pixel = p_cam.z() > kMinSearchDepth ? camera.Project(p_cam) : std::nullopt;
    const auto match =
        pixel && camera.Contains(*pixel, kBorder_px)
            ? grid.Nearest(*pixel, options_.search_radius_px, known.descriptor, matching)
            : std::nullopt;
    if (match) {
      const std::pair found(match->distance, key);
      const auto [it, is_new] = nearest.try_emplace(match->b, found);
      it->second = std::min(it->second, found);
    }
  }
  std::vector<Match> matches;
  for (const auto& [corner, found] : nearest) {
    if (const auto ray = camera.Unproject(corners[corner].pixel.cast<double>())) {
      const double sigma_px = CornerSigma(corners[corner], options_.pixel_sigma);
      matches.push_back({found.second, *ray, sigma_px * camera.PixelAngle()});
    }
  }
  return matches;
}

MapLocalisation::Seen MapLocalisation::SeenIn(const WindowPoses& window) const {
  Seen seen;
  std::map<KeyframeId, int> source_index;
  std::map<LandmarkKey, size_t> landmark_index;
  for (int i = 0; i < static_cast<int>(window.utimes.size()); ++i) {
    const auto matches = matches_.find(window.utimes[i]);
    if (matches == matches_.end()) {
      continue;
    }
    for (const Match& match : matches->second) {
      const auto at = known_.find(match.landmark);
      if (at == known_.end()) {
        continue;
      }
      const Known& known = at->second;
      if (!source_index.contains(known.source) && seen.sources.size() == kMaxSources) {
        continue;
      }
      const auto [landmark, is_new] =
          landmark_index.try_emplace(match.landmark, seen.landmarks.size());
      if (is_new) {
        const auto [source, is_new_source] =
            source_index.try_emplace(known.source, static_cast<int>(seen.sources.size()));
        if (is_new_source) {
          seen.sources.push_back(known.p_source);
        }
        seen.landmarks.push_back({source->second, known.p_map, known.covariance, {}});
      }
      seen.landmarks[landmark->second].rays.push_back({i, match.ray, match.sigma});
    }
  }
  return seen;
}

void MapLocalisation::AddKeyframe(const CameraModel& camera, const std::vector<Corner>& corners,
                                  DescriptorKind kind, const WindowPoses& window) {
  std::erase_if(matches_, [&](const auto& seen) {
    return std::find(window.utimes.begin(), window.utimes.end(), seen.first) == window.utimes.end();
  });
  const auto prior = correction_ ? PriorAt(window) : std::nullopt;
  if (!prior) {
    localized_.reset();
    return;
  }
  const Rigid3 T_map_cam = *T_map_odom() * window.T_odom_body.back() * camera.T_body_cam;
  std::vector<Match>& found = matches_[window.utimes.back()];
  found = FindIn(camera, corners, {.max_distance = LimitsOf(kind).alike}, T_map_cam);
  counters_.seen += static_cast<int64_t>(found.size());
  const Seen seen = SeenIn(window);
  localized_ = LocalizeWindow(window, camera.T_body_cam, *prior, seen.sources, seen.landmarks,
                              options_.localization);
  ++(localized_ ? counters_.localised : counters_.not_localised);
}

std::optional<Rigid3> MapLocalisation::T_map_odom() const {
  if (localized_) {
    return localized_->T_map_odom;
  }
  return correction_ ? std::make_optional(correction_->T_map_odom) : std::nullopt;
}

}  // namespace pangea::vio
