#include "loop_verification/steps/first_guess.h"

#include <cmath>
#include <set>
#include <utility>

namespace pangea {
namespace {

constexpr double kFirstMaxRatio = 0.85;  // best to second-best distance, without a prediction

std::vector<PointMatch> FirstMatches(const Verification& v) {
  std::vector<PointMatch> matches = CandidateMatches(v.windows, v.candidate);
  const DescriptorKind kind = v.windows.m.newest_keyframe().descriptor_kind;
  for (const Direction direction : kBothDirections) {
    const std::vector<PointMatch> nearest =
        MatchByDescriptor(v.windows, direction, LimitsOf(kind).alike, kFirstMaxRatio);
    matches.insert(matches.end(), nearest.begin(), nearest.end());
  }
  return Distinct(matches);
}

// Unit ray of a corner of the newest keyframe, in the window's axes.
Eigen::Vector3d UnitRay(const Window& window, int corner) {
  const Eigen::Vector2d ray = window.frames.back()->ray(corner);
  return window.T_w_cam.back().q * Eigen::Vector3d(ray.x(), ray.y(), 1.0).normalized();
}

// Sigma of the ray, radians.
double CornerAngleSigma(const Window& window, int corner) {
  const Keyframe& keyframe = window.newest_keyframe();
  return CornerSigma(keyframe.corners[corner], kCornerSigma_px) * keyframe.camera.PixelAngle();
}

std::vector<RayPair> RayPairs(const Verification& v) {
  const auto& [m, c] = v.windows;
  std::vector<RayPair> pairs;
  for (const auto& [corner_c, corner_m] : v.candidate.corner_matches) {
    if (!c.frames.back()->has_ray(corner_c) || !m.frames.back()->has_ray(corner_m)) {
      continue;
    }
    const double sigma_c = CornerAngleSigma(c, corner_c);
    const double sigma_m = CornerAngleSigma(m, corner_m);
    pairs.push_back({UnitRay(m, corner_m), UnitRay(c, corner_c),
                     std::sqrt(sigma_c * sigma_c + sigma_m * sigma_m +
                               v.guess_tilt_sigma * v.guess_tilt_sigma)});
  }
  return pairs;
}

}  // namespace

std::string GuessPose(const FirstGuessOptions& options, Verification* verification) {
  Verification& v = *verification;
  v.first_matches = FirstMatches(v);
  if (static_cast<int>(v.first_matches.size()) < options.min_pnp_inliers) {
    return "too few matched points with a depth";
  }
  const auto& [m, c] = v.windows;
  const uint64_t seed = StableHash(m.newest_keyframe().id, c.newest_keyframe().id, 1);
  v.pnp = SolveUprightPnp(v.Observations(v.first_matches), RayPairs(v), c.T_w_cam.back().t,
                          m.T_w_cam.back().t, v.guess_tilt_sigma, seed);
  if (!v.pnp) {
    return "PnP found no pose";
  }
  v.pose = v.pnp->pose;
  std::set<std::pair<Direction, int>> landmarks;
  for (const int i : v.pnp->inliers) {
    landmarks.emplace(v.first_matches[i].direction, v.first_matches[i].landmark);
  }
  return v.AtLeast("min_pnp_inliers", static_cast<double>(landmarks.size()),
                   options.min_pnp_inliers)
             ? ""
             : "PnP found too few inliers";
}

}  // namespace pangea
