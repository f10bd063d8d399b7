#pragma once

// The alignment of two gravity-aligned windows from matched corners, by RANSAC over the smallest
// sample that fixes it: with roll and pitch known, two points give yaw and translation (the idea of
// Kukelova et al., "Closed-form solutions to minimal absolute pose problems with known vertical
// direction", ACCV 2010). Both directions vote: m's points in c's cameras and c's points in m's;
// matches without a depth vote by the epipolar constraint. Seeded, so the same in every run.

#include <cstdint>
#include <optional>
#include <vector>

#include "loop_verification/correspondences/point_observation.h"

namespace pangea {

// Poses T_w_cam_yawed such that two points p_w lie on two rays of a camera whose roll and pitch are
// known: rays are given in a gravity-aligned frame g at the camera centre, result p_w = Rz(yaw) p_g
// + t. Up to two.
std::vector<Rigid3> SolveUprightTwoPoint(const Eigen::Vector3d& p1_w, const Eigen::Vector3d& p2_w,
                                         const Eigen::Vector3d& ray1_g,
                                         const Eigen::Vector3d& ray2_g);

// Two matched corners of the newest keyframes without a depth: unit rays in the window frames.
struct RayPair {
  Eigen::Vector3d ray_m = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d ray_c = Eigen::Vector3d::UnitZ();
  double sigma = 0;  // radians, of both together
};

struct UprightPnpResult {
  PoseEstimate pose;
  std::vector<int> inliers;  // indices into the observations, ascending
};

// `origin_c`, `origin_m`: the newest cameras' centres in their windows, where the ray pairs begin.
// `tilt_sigma`: radians, of roll and pitch between the windows.
std::optional<UprightPnpResult> SolveUprightPnp(const std::vector<PointObservation>& observations,
                                                const std::vector<RayPair>& ray_pairs,
                                                const Eigen::Vector3d& origin_c,
                                                const Eigen::Vector3d& origin_m, double tilt_sigma,
                                                uint64_t seed);

}  // namespace pangea
