#include "loop_verification/matched_corners.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/nearest_corner.h"

namespace pangea {
namespace {

constexpr double kPixelSigma = 1;  // of a corner on octave 0
constexpr double kOtherCorner_px = 4;
constexpr double kMaxLineSigmas = 3;  // from the epipolar line
constexpr double kMaxRayChi2 = 9.2;   // 99 % of 2 degrees of freedom
constexpr double kMinBaseline_m = 0.02;
constexpr double kNearest_m = 0.2, kFarthest_m = 60;
// Verification treats the errors of landmarks as independent; a common error is an error of scale,
// so it must be small.
constexpr double kMaxOdometrySigma = 0.05;   // relative to the depth
constexpr double kMaxNeighbourRatio = 0.85;  // best to second-best distance
constexpr size_t kMaxAdded = 250;            // each adds to the time of a verification
constexpr int kNotOfTheWindow = -1;

// A neighbouring keyframe that may see corners of the newest keyframe, the host.
struct Neighbour {
  int frame = kNotOfTheWindow;
  const KeyframeView* view = nullptr;
  Rigid3 T_cam_host;
  double sigma_m = 0, sigma_rad = 0;  // of the odometry between the two
  // Corners that are no landmark yet: index, ray, and its sigma.
  std::vector<int> corners;
  std::vector<float> x, y;
  std::vector<double> sigmas;
  double largest_sigma = 0;
};

// A neighbour's observation of a corner of the host.
struct Sight {
  const Neighbour* neighbour = nullptr;
  int corner = 0;
  double sigma = 0;         // of the rays' difference on the plane z = 1
  double corner_sigma = 0;  // the neighbour's part of it
};

struct InverseDepth {
  double value = 0, sigma = 0;  // 1/m
  double odometry_sigma = 0;    // the part common to all corners of the host
};

Eigen::Vector3d Ray(const KeyframeView& view, int corner) { return view.ray(corner).homogeneous(); }

double RaySigma(const KeyframeView& view, int corner) {
  const Keyframe& keyframe = view.keyframe();
  return CornerSigma(keyframe.corners[corner], kPixelSigma) * keyframe.camera.PixelAngle();
}

class Triangulation {
 public:
  Triangulation(const Window& window, const KeyframeWindow& after) : host_(*window.frames.back()) {
    OdometryError error;
    for (int f = window.newest() - 1; f >= 0; --f) {
      error.Add(*window.keyframe(f + 1).edge);
      AddNeighbour(f, *window.frames[f], window.T_w_cam[f].Inverse() * window.T_w_cam.back(), error,
                   window.landmark_of_corner[f]);
    }
    error = {};
    Rigid3 T_host_body = host_.keyframe().camera.T_body_cam.Inverse();
    for (const auto& view : after) {
      const Keyframe& keyframe = view->keyframe();
      error.Add(*keyframe.edge);
      T_host_body = T_host_body * keyframe.edge->T_from_this;
      const Rigid3 T_host_cam = T_host_body * keyframe.camera.T_body_cam;
      AddNeighbour(kNotOfTheWindow, *view, T_host_cam.Inverse(), error,
                   std::vector<int>(view->keyframe().corners.size(), -1));
    }
  }

  std::vector<Sight> Sights(int corner) {
    std::vector<Sight> sights;
    const double sigma = RaySigma(host_, corner);
    for (const Neighbour& neighbour : neighbours_) {
      if (const auto sight = Find(corner, sigma, neighbour)) {
        sights.push_back(*sight);
      }
    }
    return sights;
  }

  // Gauss-Newton over the inverse depth alone; empty if a ray contradicts the result.
  std::optional<InverseDepth> Solve(int corner, const std::vector<Sight>& sights) const {
    constexpr int kIterations = 10;
    constexpr double kStart = 0.5, kEnough = 1e-6;  // 1/m
    const Eigen::Vector3d ray = Ray(host_, corner);
    InverseDepth depth{kStart, 0, 0};
    double step = 1;
    for (int i = 0; i < kIterations && std::abs(step) > kEnough; ++i) {
      double information = 0, gradient = 0;
      for (const Sight& sight : sights) {
        const auto [r, J] = Residual(sight, ray, depth.value);
        information += J.squaredNorm();
        gradient += J.dot(r);
      }
      if (!(information > 0)) {
        return std::nullopt;
      }
      step = gradient / information;
      depth.value -= step;
      if (!(depth.value > 1 / kFarthest_m && depth.value < 1 / kNearest_m)) {
        return std::nullopt;
      }
    }
    const bool agreed = std::ranges::all_of(sights, [&](const Sight& sight) {
      const Rigid3& T = sight.neighbour->T_cam_host;
      const bool in_front = (T.q * ray + T.t * depth.value).z() > 0;
      return in_front && Residual(sight, ray, depth.value).first.squaredNorm() <= kMaxRayChi2;
    });
    if (!agreed) {
      return std::nullopt;
    }
    SetSigmas(corner, sights, &depth);
    return depth;
  }

 private:
  // Accumulated sigmas of successive odometry edges, isotropic.
  struct OdometryError {
    double var_m = 0, var_rad = 0;
    void Add(const OdometryEdge& edge) {
      var_m += edge.covariance.topLeftCorner<3, 3>().trace() / 3;
      var_rad += edge.covariance.bottomRightCorner<3, 3>().trace() / 3;
    }
  };

  void AddNeighbour(int frame, const KeyframeView& view, const Rigid3& T_cam_host,
                    const OdometryError& error, const std::vector<int>& landmark_of_corner) {
    Neighbour neighbour;
    neighbour.frame = frame;
    neighbour.view = &view;
    neighbour.T_cam_host = T_cam_host;
    neighbour.sigma_m = std::sqrt(error.var_m);
    neighbour.sigma_rad = std::sqrt(error.var_rad);
    for (int i = 0; i < static_cast<int>(landmark_of_corner.size()); ++i) {
      if (landmark_of_corner[i] < 0 && view.has_ray(i)) {
        const Eigen::Vector3d ray = Ray(view, i);
        neighbour.corners.push_back(i);
        neighbour.x.push_back(static_cast<float>(ray.x()));
        neighbour.y.push_back(static_cast<float>(ray.y()));
        neighbour.sigmas.push_back(RaySigma(view, i));
        neighbour.largest_sigma = std::max(neighbour.largest_sigma, neighbour.sigmas.back());
      }
    }
    if (neighbour.T_cam_host.t.norm() > kMinBaseline_m) {
      neighbours_.push_back(std::move(neighbour));
    }
  }

  // The neighbour's corners near the epipolar line, ascending; valid until the next call. Most are
  // rejected by a single-precision distance, without branches.
  std::span<const int> NearLine(const Eigen::Vector3d& line, double host_sigma,
                                const Neighbour& neighbour) {
    constexpr double kSlack = 1.01, kSinglePrecision = 1e-5;
    const double norm = line.head<2>().norm();
    const auto reach = static_cast<float>(
        kSlack * kMaxLineSigmas * norm *
            std::hypot(host_sigma, neighbour.largest_sigma, neighbour.sigma_rad) +
        kSinglePrecision * line.norm());
    const Eigen::Vector3f a = line.cast<float>();
    const size_t n = neighbour.corners.size();
    distances_.resize(std::max(n, distances_.size()));
    near_.resize(distances_.size());
    for (size_t k = 0; k < n; ++k) {
      distances_[k] = std::abs(a.x() * neighbour.x[k] + a.y() * neighbour.y[k] + a.z());
    }
    size_t num_near = 0;
    for (size_t k = 0; k < n; ++k) {
      near_[num_near] = static_cast<int>(k);
      num_near += distances_[k] <= reach ? 1 : 0;
    }
    size_t num_nearer = 0;
    for (size_t i = 0; i < num_near; ++i) {
      const int k = near_[i];
      const double distance = std::abs(line.dot(Ray(*neighbour.view, neighbour.corners[k]))) / norm;
      if (distance <
          kMaxLineSigmas * std::hypot(host_sigma, neighbour.sigmas[k], neighbour.sigma_rad)) {
        near_[num_nearer++] = neighbour.corners[k];
      }
    }
    return {near_.data(), num_nearer};
  }

  // The corner near the epipolar line with the nearest descriptor, if it passes the ratio test.
  std::optional<Sight> Find(int host_corner, double host_sigma, const Neighbour& neighbour) {
    const Eigen::Vector3d line =
        neighbour.T_cam_host.t.cross(neighbour.T_cam_host.q * Ray(host_, host_corner));
    const std::span<const int> near = NearLine(line, host_sigma, neighbour);
    if (near.empty()) {
      return std::nullopt;
    }
    const std::vector<Corner>& corners = neighbour.view->keyframe().corners;
    const Descriptor& descriptor = host_.keyframe().corners[host_corner].descriptor;
    const NearestCorner nearest = FindNearest(
        corners, near, [&](int i) { return HammingDistance(corners[i].descriptor, descriptor); },
        LimitsOf(host_.keyframe().descriptor_kind).alike, kOtherCorner_px);
    if (nearest.index < 0 || !nearest.PassesRatio(kMaxNeighbourRatio)) {
      return std::nullopt;
    }
    const double sigma = RaySigma(*neighbour.view, nearest.index);
    return Sight{&neighbour, nearest.index, std::hypot(host_sigma, sigma, neighbour.sigma_rad),
                 sigma};
  }

  // The residual in sigmas, and its derivative with respect to the inverse depth.
  static std::pair<Eigen::Vector2d, Eigen::Vector2d> Residual(const Sight& sight,
                                                              const Eigen::Vector3d& host_ray,
                                                              double inverse_depth) {
    const Rigid3& T = sight.neighbour->T_cam_host;
    const Eigen::Vector3d p = T.q * host_ray + T.t * inverse_depth;
    const Eigen::Vector2d projected = p.head<2>() / p.z();
    return {(projected - sight.neighbour->view->ray(sight.corner)) / sight.sigma,
            (T.t.head<2>() - projected * T.t.z()) / (p.z() * sight.sigma)};
  }

  // Only the neighbours' own pixel noise is independent; the rest does not average out.
  void SetSigmas(int host_corner, const std::vector<Sight>& sights, InverseDepth* depth) const {
    double information = 0, own = 0, host = 0, odometry = 0;
    for (const Sight& sight : sights) {
      const double J = Residual(sight, Ray(host_, host_corner), depth->value).second.norm();
      const double step = depth->value * sight.neighbour->sigma_m;  // as seen from the point
      information += J * J;
      own += std::pow(J * sight.corner_sigma / sight.sigma, 2);
      host += J * RaySigma(host_, host_corner) / sight.sigma;
      odometry += J * std::hypot(sight.neighbour->sigma_rad, step) / sight.sigma;
    }
    depth->sigma = std::hypot(std::sqrt(own), host, odometry) / information;
    depth->odometry_sigma = odometry / information;
  }

  const KeyframeView& host_;
  std::vector<Neighbour> neighbours_;
  // Of NearLine, allocated once.
  std::vector<float> distances_;
  std::vector<int> near_;
};

void AddLandmark(int host_corner, const InverseDepth& depth, const std::vector<Sight>& sights,
                 Window* window) {
  const CornerRef host{window->newest(), host_corner};
  WindowLandmark landmark =
      MakeWindowLandmark(*window, kNoLandmark, host, depth.value, depth.sigma);
  landmark.observations = {host};
  for (const Sight& sight : sights) {
    if (sight.neighbour->frame != kNotOfTheWindow) {
      landmark.observations.push_back({sight.neighbour->frame, sight.corner});
    }
  }
  std::ranges::sort(landmark.observations, {}, &CornerRef::frame);
  for (const CornerRef& seen : landmark.observations) {
    window->landmark_of_corner[seen.frame][seen.corner] =
        static_cast<int>(window->landmarks.size());
  }
  window->landmarks.push_back(std::move(landmark));
}

}  // namespace

void TriangulateMatchedCorners(const TriangulationOptions& options, const KeyframeWindow& after,
                               Window* window) {
  if (static_cast<int>(window->landmarks.size()) > options.few_landmarks) {
    return;
  }
  Triangulation triangulation(*window, after);
  const size_t most = window->landmarks.size() + kMaxAdded;
  const int host = window->newest();
  const int num_corners = static_cast<int>(window->newest_keyframe().corners.size());
  for (int corner = 0; corner < num_corners && window->landmarks.size() < most; ++corner) {
    if (window->landmark_of_corner[host][corner] >= 0 || !window->frames[host]->has_ray(corner)) {
      continue;
    }
    const std::vector<Sight> sights = triangulation.Sights(corner);
    const auto depth = triangulation.Solve(corner, sights);
    if (depth && depth->sigma < kMaxRelativeDepthSigma * depth->value &&
        depth->odometry_sigma < kMaxOdometrySigma * depth->value) {
      AddLandmark(corner, *depth, sights, window);
    }
  }
}

}  // namespace pangea
