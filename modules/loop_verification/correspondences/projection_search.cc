#include "loop_verification/correspondences/projection_search.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include "core/nearest_corner.h"

namespace pangea {
namespace {

constexpr double kBorderPx = 12;
// Two corners this near are one: a tracked and a detected one of the same spot.
constexpr double kSamePx = 4;

// The nearest of the landmark's descriptors in its own window.
int LandmarkDistance(const Window& holder, const WindowLandmark& landmark,
                     const Descriptor& descriptor) {
  int best = kNoDistance;
  for (const CornerRef& ref : landmark.observations) {
    best = std::min(best, HammingDistance(holder.corner(ref).descriptor, descriptor));
  }
  return best;
}

// One corner, one landmark: the nearer descriptor keeps it.
std::vector<PointMatch> ResolveCorners(const std::vector<PointMatch>& matches) {
  std::map<int, size_t> owner;
  for (size_t i = 0; i < matches.size(); ++i) {
    const auto [it, added] = owner.emplace(matches[i].observed.corner, i);
    if (!added && matches[i].distance < matches[it->second].distance) {
      it->second = i;
    }
  }
  std::vector<PointMatch> kept;
  for (size_t i = 0; i < matches.size(); ++i) {
    if (owner.at(matches[i].observed.corner) == i) {
      kept.push_back(matches[i]);
    }
  }
  return kept;
}

struct Prediction {
  Eigen::Vector2d pixel;
  Eigen::Matrix2d covariance;  // pixels^2, without the corner's own noise
  bool comparable = false;
};

std::optional<Prediction> Predict(const Window& holder, const WindowLandmark& landmark,
                                  const Window& observer, int frame,
                                  const Rigid3& T_observer_holder, Direction direction,
                                  const PoseEstimate& pose, const SearchOptions& options) {
  const CameraModel& camera = observer.keyframe(frame).camera;
  const Rigid3& T_w_cam = observer.T_w_cam[frame];
  const Eigen::Vector3d y = T_observer_holder * landmark.p_w;
  const Eigen::Vector3d p_cam = T_w_cam.Inverse() * y;
  Eigen::Matrix<double, 2, 3> J_project;
  const auto pixel = camera.Project(p_cam, &J_project);
  if (!pixel || !camera.Contains(*pixel, kBorderPx) || p_cam.z() > options.max_depth_m) {
    return std::nullopt;
  }
  // The two lines of sight, in the observing window.
  const Eigen::Vector3d view_ray = y - T_w_cam.t;
  const Eigen::Vector3d host_view_ray =
      y - T_observer_holder * holder.T_w_cam[landmark.host.frame].t;
  const double scale = std::abs(std::log(view_ray.norm() / host_view_ray.norm()));
  const double angle =
      std::acos(std::clamp(view_ray.normalized().dot(host_view_ray.normalized()), -1.0, 1.0));
  if (angle > options.max_view_angle || scale > std::log(options.max_scale)) {
    return std::nullopt;
  }
  Prediction prediction;
  prediction.pixel = *pixel;
  prediction.comparable = angle < 0.6 * options.max_view_angle &&
                          scale < 0.6 * std::log(options.max_scale) &&
                          camera.Contains(*pixel, 2 * kBorderPx);
  const Eigen::Matrix<double, 2, 3> J_y = J_project * T_w_cam.R().transpose();
  Eigen::Matrix<double, 2, 6> J_pose;
  if (direction == Direction::kForward) {
    const Eigen::Matrix3d R_t = pose.T_m_c.R().transpose();
    J_pose << -J_y * R_t, J_y * R_t * Hat(landmark.p_w - pose.T_m_c.t);
  } else {
    J_pose << J_y, -J_y * Hat(pose.T_m_c.q * landmark.p_w);
  }
  const Eigen::Vector2d depth = J_y * (T_observer_holder.q * landmark.depth_sigma_w);
  prediction.covariance = J_pose * pose.covariance * J_pose.transpose() + depth * depth.transpose();
  return prediction;
}

}  // namespace

SearchResult SearchByProjection(const WindowPair& windows, Direction direction, int frame,
                                const PoseEstimate& pose, const SearchOptions& options) {
  const Window& holder = windows.Holder(direction);
  const Window& observer = windows.Observer(direction);
  const Rigid3 T_observer_holder = ObserverFromHolder(direction, pose.T_m_c);
  const KeyframeView& view = *observer.frames[frame];
  const Keyframe& keyframe = view.keyframe();

  SearchResult result;
  std::vector<PointMatch> found;
  std::vector<int> near;
  for (size_t l = 0; l < holder.landmarks.size(); ++l) {
    const WindowLandmark& landmark = holder.landmarks[l];
    const auto prediction =
        Predict(holder, landmark, observer, frame, T_observer_holder, direction, pose, options);
    if (!prediction) {
      continue;
    }
    result.projections.push_back(
        {static_cast<int>(l), prediction->pixel, false, prediction->comparable});
    const double host_sigma = CornerSigma(holder.corner(landmark.host), options.pixel_sigma);
    const double spread = std::sqrt(prediction->covariance.trace() + 2 * host_sigma * host_sigma);
    near = view.grid().Within(prediction->pixel,
                              std::clamp(3 * spread, options.min_radius_px, options.max_radius_px));
    std::erase_if(near, [&](int i) {
      const double sigma = CornerSigma(keyframe.corners[i], options.pixel_sigma);
      Eigen::Matrix2d covariance = prediction->covariance;
      covariance.diagonal().array() += sigma * sigma + host_sigma * host_sigma;
      const Eigen::Vector2d error = keyframe.corners[i].pixel.cast<double>() - prediction->pixel;
      return !view.has_ray(i) || error.dot(covariance.inverse() * error) > options.max_chi2;
    });
    const auto distance_of = [&](int i) {
      return LandmarkDistance(holder, landmark, keyframe.corners[i].descriptor);
    };
    const NearestCorner nearest =
        FindNearest(keyframe.corners, near, distance_of, options.max_hamming, kSamePx);
    if (nearest.index >= 0 && nearest.distance < options.max_ratio * nearest.second) {
      found.push_back({direction, static_cast<int>(l), {frame, nearest.index}, nearest.distance});
    }
  }
  result.matches = ResolveCorners(found);
  size_t next = 0;
  for (Projection& projection : result.projections) {
    if (next < result.matches.size() && result.matches[next].landmark == projection.landmark) {
      projection.found = true;
      ++next;
    }
  }
  return result;
}

std::vector<PointMatch> MatchByDescriptor(const WindowPair& windows, Direction direction,
                                          int max_hamming, double max_ratio) {
  const Window& holder = windows.Holder(direction);
  const Window& observer = windows.Observer(direction);
  const int frame = observer.newest();
  const Keyframe& keyframe = observer.keyframe(frame);
  std::vector<int> corners;
  for (size_t i = 0; i < keyframe.corners.size(); ++i) {
    if (observer.frames[frame]->has_ray(static_cast<int>(i))) {
      corners.push_back(static_cast<int>(i));
    }
  }
  std::vector<PointMatch> matches;
  for (size_t l = 0; l < holder.landmarks.size(); ++l) {
    // The newest view of it stands for all: M times the comparisons gain little here.
    WindowLandmark newest = holder.landmarks[l];
    std::erase_if(newest.observations, [last = newest.observations.back().frame](
                                           const CornerRef& ref) { return ref.frame != last; });
    const auto distance_of = [&](int i) {
      return LandmarkDistance(holder, newest, keyframe.corners[i].descriptor);
    };
    const NearestCorner nearest =
        FindNearest(keyframe.corners, corners, distance_of, max_hamming, kSamePx);
    if (nearest.index >= 0 && nearest.distance < max_ratio * nearest.second) {
      matches.push_back({direction, static_cast<int>(l), {frame, nearest.index}, nearest.distance});
    }
  }
  return ResolveCorners(matches);
}

}  // namespace pangea
