#include "loop_verification/window.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "core/median.h"
#include "loop_verification/matched_corners.h"

namespace pangea {
namespace {

// Baseline, relative to the median depth, at which kWindowKeyframes keyframes suffice.
constexpr double kMinBaseline = 0.25;

struct Estimate {
  CornerRef host;
  double inverse_depth = 0;
  double sigma = 0;
  double relative() const { return sigma / inverse_depth; }
};

// Metres; empty without map points.
std::optional<double> MedianDepth(const Keyframe& keyframe) {
  std::vector<double> depths;
  for (const MapPoint& point : keyframe.points) {
    depths.push_back(1.0 / static_cast<double>(point.inverse_depth));
  }
  return depths.empty() ? std::nullopt : std::optional(Median(std::move(depths)));
}

// Depths by landmark id, ascending; points without a landmark come last, unmerged. A landmark gets
// its newest depth, which uses most observations. (Not the one with the smallest relative sigma:
// that favours depths that are too small by error.)
std::vector<std::pair<int32_t, Estimate>> DepthsOf(const Window& window) {
  std::map<int32_t, Estimate> newest;
  std::vector<std::pair<int32_t, Estimate>> alone;
  for (int f = 0; f <= window.newest(); ++f) {
    for (const MapPoint& point : window.keyframe(f).points) {
      const Estimate estimate{{f, point.corner},
                              point.inverse_depth,
                              std::sqrt(static_cast<double>(point.inverse_depth_var))};
      if (!window.frames[f]->has_ray(point.corner) ||
          estimate.relative() > kMaxRelativeDepthSigma) {
        continue;
      }
      const int32_t id = window.corner(estimate.host).landmark_id;
      if (id == kNoLandmark) {
        alone.emplace_back(id, estimate);
      } else {
        newest[id] = estimate;
      }
    }
  }
  std::vector<std::pair<int32_t, Estimate>> depths(newest.begin(), newest.end());
  depths.insert(depths.end(), alone.begin(), alone.end());
  return depths;
}

// Adds a landmark with all its corners.
void AddLandmark(int32_t id, const Estimate& estimate, Window* window) {
  WindowLandmark landmark =
      MakeWindowLandmark(*window, id, estimate.host, estimate.inverse_depth, estimate.sigma);
  const int index = static_cast<int>(window->landmarks.size());
  for (int f = 0; f <= window->newest(); ++f) {
    std::vector<int> corners;
    if (id != kNoLandmark) {
      corners = window->frames[f]->CornersOfLandmark(id);
    } else if (f == estimate.host.frame) {
      corners = {estimate.host.corner};
    }
    for (const int corner : corners) {
      if (window->frames[f]->has_ray(corner)) {
        landmark.observations.push_back({f, corner});
        window->landmark_of_corner[f][corner] = index;
      }
    }
  }
  window->landmarks.push_back(std::move(landmark));
}

}  // namespace

std::vector<Rigid3> PosesAlongEdges(const KeyframeWindow& frames) {
  std::vector<Rigid3> T_w_body(frames.size());
  T_w_body.back().q = frames.back()->keyframe().T_odom_body.q;
  for (size_t i = frames.size() - 1; i > 0; --i) {
    T_w_body[i - 1] = T_w_body[i] * frames[i]->keyframe().edge->T_from_this.Inverse();
  }
  return T_w_body;
}

KeyframeWindow LastOfWindow(const KeyframeWindow& frames) {
  const KeyframeView& newest = *frames.back();
  const std::optional<double> depth_m = MedianDepth(newest.keyframe());
  double baseline_m = 0;
  size_t count = 0;
  for (auto view = frames.rbegin(); view != frames.rend(); ++view) {
    const bool wide = depth_m && baseline_m >= kMinBaseline * *depth_m;
    if (static_cast<int>(count) >= (wide ? kWindowKeyframes : kMaxWindowKeyframes)) {
      break;
    }
    ++count;
    baseline_m = std::max(baseline_m, ((*view)->T_odom_cam().t - newest.T_odom_cam().t).norm());
  }
  return {frames.end() - static_cast<std::ptrdiff_t>(count), frames.end()};
}

WindowLandmark MakeWindowLandmark(const Window& window, int32_t id, const CornerRef& host,
                                  double inverse_depth, double inverse_depth_sigma) {
  WindowLandmark landmark;
  landmark.id = id;
  landmark.host = host;
  landmark.inverse_depth = inverse_depth;
  landmark.inverse_depth_sigma = inverse_depth_sigma;
  const Eigen::Vector2d ray = window.frames[host.frame]->ray(host.corner);
  const Rigid3& T_w_cam = window.T_w_cam[host.frame];
  landmark.p_w = T_w_cam * (Eigen::Vector3d(ray.x(), ray.y(), 1.0) / inverse_depth);
  // p - o is proportional to 1/rho: d(p)/d(rho) = -(p - o) / rho.
  landmark.depth_sigma_w = -(landmark.p_w - T_w_cam.t) * (inverse_depth_sigma / inverse_depth);
  return landmark;
}

Window MakeWindow(KeyframeWindow frames, const WindowOptions& options,
                  const KeyframeWindow& after) {
  Window window;
  window.frames = std::move(frames);
  window.T_w_body = PosesAlongEdges(window.frames);
  for (size_t i = 0; i < window.frames.size(); ++i) {
    const Keyframe& keyframe = window.frames[i]->keyframe();
    window.T_w_cam.push_back(window.T_w_body[i] * keyframe.camera.T_body_cam);
    window.landmark_of_corner.emplace_back(keyframe.corners.size(), -1);
  }
  for (const auto& [id, estimate] : DepthsOf(window)) {
    AddLandmark(id, estimate, &window);
  }
  TriangulateMatchedCorners(options.triangulation, after, &window);
  return window;
}

}  // namespace pangea
