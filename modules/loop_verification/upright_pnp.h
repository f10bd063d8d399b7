#pragma once

// Aligns two gravity-aligned windows by matched corners, with RANSAC over minimal samples: with
// roll and pitch known, two points give yaw and translation (the idea of Kukelova et al.,
// "Closed-form solutions to minimal absolute pose problems with known vertical direction", ACCV
// 2010). Observations of both directions are scored: m's points in c's cameras and c's points in
// m's; matches without a depth are scored by the epipolar constraint. Seeded, so reproducible.

#include <cstdint>
#include <optional>
#include <vector>

#include "loop_verification/correspondences/point_observation.h"

namespace pangea {

// Returns up to two poses with which two points p_w lie on two rays of a camera with known roll and
// pitch. The rays are in a gravity-aligned frame g at the camera centre; a pose means p_w = Rz(yaw)
// p_g + t.
std::vector<Rigid3> SolveUprightTwoPoint(const Eigen::Vector3d& p1_w, const Eigen::Vector3d& p2_w,
                                         const Eigen::Vector3d& ray1_g,
                                         const Eigen::Vector3d& ray2_g);

// A match without a depth between corners of the two newest keyframes: unit rays in the window
// frames.
struct RayPair {
  Eigen::Vector3d ray_m = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d ray_c = Eigen::Vector3d::UnitZ();
  double sigma = 0;  // radians, of both rays combined
};

struct UprightPnpResult {
  PoseEstimate pose;
  std::vector<int> inliers;  // indices into the observations, ascending
};

// `origin_c`, `origin_m`: centres of the newest cameras in their window frames, origins of the ray
// pairs. `tilt_sigma`: sigma of roll and pitch between the windows, radians. Empty if no pose is
// found.
std::optional<UprightPnpResult> SolveUprightPnp(const std::vector<PointObservation>& observations,
                                                const std::vector<RayPair>& ray_pairs,
                                                const Eigen::Vector3d& origin_c,
                                                const Eigen::Vector3d& origin_m, double tilt_sigma,
                                                uint64_t seed);

}  // namespace pangea
