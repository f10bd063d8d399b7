#include "map_points/track_point.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "core/numerics/triangulation.h"

namespace pangea {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr size_t kMinRays = 3;             // of a landmark
constexpr int32_t kMaxReach = 100;         // keyframes before and after the source
constexpr double kMaxRelativeSigma = 0.1;  // relative to the distance
constexpr double kMinTrackDepth = 0.3;     // m
constexpr int kIterations = 3;
constexpr double kMaxChi2 = 3;  // per degree of freedom

struct Ray {
  Rigid3 T_map_cam;
  Vector2d ray;
  Eigen::Matrix2d sqrt_info;
};

std::optional<Ray> RayIn(const MapPoses& poses, const KeyframeId& id, int32_t landmark_id,
                         KeyframeStore* store) {
  const auto pose = poses.find(id);
  const auto view = pose == poses.end() ? nullptr : store->Find(id);
  if (view == nullptr) {
    return std::nullopt;
  }
  const std::vector<int> corners = view->CornersOfLandmark(landmark_id);
  if (corners.empty() || !view->has_ray(corners.front())) {
    return std::nullopt;
  }
  return Ray{pose->second * view->keyframe().camera.T_body_cam, view->ray(corners.front()),
             view->pixel_jacobian(corners.front()) / kTrackPointSigma_px};
}

// The track's observations: a track is one contiguous run of keyframes. Bounded: an agent that
// stands still sees a landmark for hours.
std::vector<Ray> RaysOf(const MapPoses& poses, const KeyframeId& id, int32_t landmark_id,
                        KeyframeStore* store) {
  std::vector<Ray> rays;
  for (const int step : {-1, 1}) {
    for (int32_t seq = step < 0 ? id.seq : id.seq + 1; std::abs(seq - id.seq) <= kMaxReach;
         seq += step) {
      const auto ray = RayIn(poses, {id.map, seq}, landmark_id, store);
      if (!ray) {
        break;
      }
      rays.push_back(*ray);
    }
  }
  return rays;
}

// The rays in the map frame.
std::vector<LineOfSight> LinesOfSight(const std::vector<Ray>& rays) {
  std::vector<LineOfSight> lines;
  for (const Ray& ray : rays) {
    lines.push_back({ray.T_map_cam.t, ray.T_map_cam.q * ray.ray.homogeneous().normalized()});
  }
  return lines;
}

}  // namespace

std::optional<TrackPoint> PointOfTrack(const MapPoses& poses, const KeyframeView& source,
                                       int corner, KeyframeStore* store) {
  const Keyframe& keyframe = source.keyframe();
  const std::vector<Ray> rays =
      RaysOf(poses, keyframe.id, keyframe.corners[corner].landmark_id, store);
  if (rays.size() < kMinRays) {
    return std::nullopt;
  }
  const auto start = TriangulateMidpoint(LinesOfSight(rays));
  if (!start) {
    return std::nullopt;
  }
  Vector3d p = *start;
  Matrix3d information;
  double cost = 0;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    information.setZero();
    Vector3d g = Vector3d::Zero();
    cost = 0;
    for (const Ray& ray : rays) {
      const Vector3d y = ray.T_map_cam.Inverse() * p;
      if (!(y.z() > kMinTrackDepth)) {
        return std::nullopt;
      }
      Eigen::Matrix<double, 2, 3> J;
      J << 1 / y.z(), 0, -y.x() / (y.z() * y.z()), 0, 1 / y.z(), -y.y() / (y.z() * y.z());
      J = ray.sqrt_info * J * ray.T_map_cam.R().transpose();
      const Vector2d r = ray.sqrt_info * (y.hnormalized() - ray.ray);
      information += J.transpose() * J;
      g += J.transpose() * r;
      cost += r.squaredNorm();
    }
    p -= information.ldlt().solve(g);
  }
  const TrackPoint point{p, information.inverse()};
  const double distance = (p - rays.front().T_map_cam.t).norm();
  const double sigma = std::sqrt(point.covariance.trace());
  const double degrees_of_freedom = 2.0 * static_cast<double>(rays.size()) - 3;
  const bool fits = cost < kMaxChi2 * degrees_of_freedom;
  return fits && sigma < kMaxRelativeSigma * distance ? std::make_optional(point) : std::nullopt;
}

}  // namespace pangea
