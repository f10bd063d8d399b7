#include "loop_verification/correspondences/projection_search.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>

#include "core/matching.h"
#include "core/nearest_corner.h"

namespace pangea {
namespace {

constexpr double kMaxRatio =
    0.9;  // best to second-best distance, corners kSamePx and further apart
constexpr double kMaxChi2 = 11.8;  // within 3 sigma of the prediction (2 degrees of freedom)
// Bounds on the search radius, whatever the prediction's covariance is.
constexpr double kMinRadiusPx = 4;
constexpr double kMaxRadiusPx = 40;
constexpr double kMaxDepth_m = 60;     // more distant points are poorly triangulated
constexpr double kMaxViewAngle = 0.9;  // radians between the two lines of sight
constexpr double kMaxScale = 3.5;      // ratio of the two distances
constexpr double kBorderPx = 12;
// Two corners nearer than this are taken as one: a tracked and a detected one of the same point.
constexpr double kSamePx = 4;

// Smallest distance to the landmark's descriptors in its own window.
int LandmarkDistance(const Window& holder, const WindowLandmark& landmark,
                     const Descriptor& descriptor) {
  int best = kNoDistance;
  for (const CornerRef& ref : landmark.observations) {
    best = std::min(best, HammingDistance(holder.corner(ref).descriptor, descriptor));
  }
  return best;
}

// Each corner keeps only the landmark with the nearest descriptor.
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

// Searches the points of one window in one keyframe of the other.
class ProjectionSearch {
 public:
  ProjectionSearch(const WindowPair& windows, Direction direction, int frame,
                   const PoseEstimate& pose)
      : holder_(windows.Holder(direction)),
        view_(*windows.Observer(direction).frames[frame]),
        p_w_cam_(windows.Observer(direction).T_w_cam[frame].t),
        T_cam_w_(windows.Observer(direction).T_w_cam[frame].Inverse()),
        R_cam_w_(windows.Observer(direction).T_w_cam[frame].R().transpose()),
        T_observer_holder_(ObserverFromHolder(direction, pose.T_m_c)),
        R_c_m_(pose.T_m_c.R().transpose()),
        direction_(direction),
        pose_(pose) {}

  std::optional<Prediction> Predict(const WindowLandmark& landmark) const {
    const CameraModel& camera = view_.keyframe().camera;
    const Eigen::Vector3d y = T_observer_holder_ * landmark.p_w;
    const Eigen::Vector3d p_cam = T_cam_w_ * y;
    Eigen::Matrix<double, 2, 3> J_project;
    const auto pixel = camera.Project(p_cam, &J_project);
    if (!pixel || !camera.Contains(*pixel, kBorderPx) || p_cam.z() > kMaxDepth_m) {
      return std::nullopt;
    }
    const auto [angle, log_scale] = ViewChange(landmark, y);
    const double max_log_scale = std::log(kMaxScale);
    if (angle > kMaxViewAngle || log_scale > max_log_scale) {
      return std::nullopt;
    }
    const bool comparable = angle < 0.6 * kMaxViewAngle && log_scale < 0.6 * max_log_scale &&
                            camera.Contains(*pixel, 2 * kBorderPx);
    const Eigen::Matrix<double, 2, 3> J_y = J_project * R_cam_w_;
    return Prediction{*pixel, Covariance(landmark, J_y), comparable};
  }

  NearestCorner Find(const WindowLandmark& landmark, const Prediction& prediction) const {
    const auto distance_of = [&](int i) {
      return LandmarkDistance(holder_, landmark, view_.keyframe().corners[i].descriptor);
    };
    return FindNearest(view_.keyframe().corners, CornersWithin(landmark, prediction), distance_of,
                       LimitsOf(view_.keyframe().descriptor_kind).predicted, kSamePx);
  }

 private:
  // Compares the host's line of sight with this one, to y in the observing window: the angle
  // between them (radians), and the ratio of the distances.
  std::pair<double, double> ViewChange(const WindowLandmark& landmark,
                                       const Eigen::Vector3d& y) const {
    const Eigen::Vector3d ray = y - p_w_cam_;
    const Eigen::Vector3d host_ray =
        y - T_observer_holder_ * holder_.T_w_cam[landmark.host.frame].t;
    return {std::acos(std::clamp(ray.normalized().dot(host_ray.normalized()), -1.0, 1.0)),
            std::abs(std::log(ray.norm() / host_ray.norm()))};
  }

  // From the uncertainty of the pose and of the point's depth, pixels^2; J_y: d(pixel)/d(y).
  Eigen::Matrix2d Covariance(const WindowLandmark& landmark,
                             const Eigen::Matrix<double, 2, 3>& J_y) const {
    Eigen::Matrix<double, 2, 6> J_pose;
    if (direction_ == Direction::kForward) {
      J_pose << -J_y * R_c_m_, J_y * R_c_m_ * Hat(landmark.p_w - pose_.T_m_c.t);
    } else {
      J_pose << J_y, -J_y * Hat(pose_.T_m_c.q * landmark.p_w);
    }
    const Eigen::Vector2d depth = J_y * (T_observer_holder_.q * landmark.depth_sigma_w);
    return J_pose * pose_.covariance * J_pose.transpose() + depth * depth.transpose();
  }

  std::vector<int> CornersWithin(const WindowLandmark& landmark,
                                 const Prediction& prediction) const {
    const double host_sigma = CornerSigma(holder_.corner(landmark.host), kCornerSigma_px);
    const double spread = std::sqrt(prediction.covariance.trace() + 2 * host_sigma * host_sigma);
    std::vector<int> near =
        view_.grid().Within(prediction.pixel, std::clamp(3 * spread, kMinRadiusPx, kMaxRadiusPx));
    std::erase_if(near, [&](int i) {
      const Corner& corner = view_.keyframe().corners[i];
      const double sigma = CornerSigma(corner, kCornerSigma_px);
      Eigen::Matrix2d covariance = prediction.covariance;
      covariance.diagonal().array() += sigma * sigma + host_sigma * host_sigma;
      const Eigen::Vector2d error = corner.pixel.cast<double>() - prediction.pixel;
      return !view_.has_ray(i) || error.dot(covariance.inverse() * error) > kMaxChi2;
    });
    return near;
  }

  const Window& holder_;
  const KeyframeView& view_;
  Eigen::Vector3d p_w_cam_;
  Rigid3 T_cam_w_;
  Eigen::Matrix3d R_cam_w_;
  Rigid3 T_observer_holder_;
  Eigen::Matrix3d R_c_m_;
  Direction direction_;
  const PoseEstimate& pose_;
};

}  // namespace

SearchResult SearchByProjection(const WindowPair& windows, Direction direction, int frame,
                                const PoseEstimate& pose) {
  const ProjectionSearch search(windows, direction, frame, pose);
  const std::vector<WindowLandmark>& landmarks = windows.Holder(direction).landmarks;
  SearchResult result;
  std::vector<PointMatch> found;
  for (int l = 0; l < static_cast<int>(landmarks.size()); ++l) {
    const auto prediction = search.Predict(landmarks[l]);
    if (!prediction) {
      continue;
    }
    result.projections.push_back({l, prediction->pixel, false, prediction->comparable});
    const NearestCorner nearest = search.Find(landmarks[l], *prediction);
    if (nearest.index >= 0 && nearest.distance < kMaxRatio * nearest.second) {
      found.push_back({direction, l, {frame, nearest.index}, nearest.distance});
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
  const KeyframeView& view = *observer.frames[frame];
  const std::vector<Corner>& corners = view.keyframe().corners;
  const DescriptorList descriptors(corners);
  const auto rival_distance =
      static_cast<uint64_t>(RivalDistance({.max_distance = max_hamming, .max_ratio = max_ratio}));
  std::vector<uint64_t> distances(corners.size()), of_octave(corners.size());
  std::vector<int> near(corners.size()), rivals;
  std::vector<PointMatch> matches;
  for (size_t l = 0; l < holder.landmarks.size(); ++l) {
    // Only the newest observation is compared: comparing all gains little here.
    const std::vector<CornerRef>& seen = holder.landmarks[l].observations;
    descriptors.Distances(holder.corner(seen.back()).descriptor, &distances);
    for (auto ref = seen.rbegin() + 1; ref != seen.rend() && ref->frame == seen.back().frame;
         ++ref) {
      descriptors.Distances(holder.corner(*ref).descriptor, &of_octave);
      std::ranges::transform(distances, of_octave, distances.begin(),
                             [](uint64_t a, uint64_t b) { return std::min(a, b); });
    }
    // Branch-free, since hardly any is near.
    size_t num_near = 0;
    for (size_t i = 0; i < corners.size(); ++i) {
      near[num_near] = static_cast<int>(i);
      num_near += distances[i] <= rival_distance ? 1 : 0;
    }
    rivals.assign(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(num_near));
    std::erase_if(rivals, [&view](int i) { return !view.has_ray(i); });
    const NearestCorner nearest = FindNearest(
        corners, rivals, [&](int i) { return static_cast<int>(distances[i]); }, max_hamming,
        kSamePx);
    if (nearest.index >= 0 && nearest.distance < max_ratio * nearest.second) {
      matches.push_back({direction, static_cast<int>(l), {frame, nearest.index}, nearest.distance});
    }
  }
  return ResolveCorners(matches);
}

}  // namespace pangea
