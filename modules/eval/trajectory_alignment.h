#pragma once

// Least-squares alignment of corresponding points: reference ~ scale * R * estimate + t.
//
// Source: Umeyama, PAMI 1991 (SE(3) and Sim(3)); for yaw only, the same problem with the rotation
// about z, whose optimum has a closed form (Zhang & Scaramuzza, IROS 2018).

#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/rigid3.h"

namespace pangea {

enum class TrajectoryAlignmentKind {
  kSe3,   // rotation and translation
  kYaw,   // rotation about z and translation: unobservable for visual-inertial odometry
  kSim3,  // rotation, translation, scale
};

std::string ToString(TrajectoryAlignmentKind kind);

struct TrajectoryAlignment {
  double scale = 1;
  Rigid3 T_reference_estimate;  // without the scale

  Eigen::Vector3d operator*(const Eigen::Vector3d& p_estimate) const {
    return T_reference_estimate.q * (scale * p_estimate) + T_reference_estimate.t;
  }
  Rigid3 operator*(const Rigid3& T_estimate_body) const {
    return {(T_reference_estimate.q * T_estimate_body.q).normalized(), *this * T_estimate_body.t};
  }
};

// Both must have the same size, at least one point. If all points are on a line or equal, part of
// the rotation is undetermined; one of the optima is returned.
TrajectoryAlignment AlignTrajectories(const std::vector<Eigen::Vector3d>& estimate,
                                      const std::vector<Eigen::Vector3d>& reference,
                                      TrajectoryAlignmentKind kind);

}  // namespace pangea
