#pragma once

// The body's motion while the rows of an image are read out. It includes accelerations: for a
// hand-held phone, a constant rotation rate would be wrong by pixels at the last row.

#include <Eigen/Core>

#include "core/rigid3.h"

namespace pangea::vio {

// All vectors are in the body frame at the start.
struct BodyMotion {
  Eigen::Vector3d omega = Eigen::Vector3d::Zero();  // rad/s
  Eigen::Vector3d alpha = Eigen::Vector3d::Zero();  // rad/s^2
  Eigen::Vector3d v = Eigen::Vector3d::Zero();      // m/s
  Eigen::Vector3d a = Eigen::Vector3d::Zero();      // m/s^2, without gravity

  // T_body_later, `s` seconds after the start; second order in s.
  Rigid3 After(double s) const {
    return {ExpSo3(s * omega + 0.5 * s * s * alpha), s * v + 0.5 * s * s * a};
  }
  // The same motion, described from `s` seconds later on.
  BodyMotion From(double s) const {
    const Eigen::Matrix3d R_later_body = After(s).R().transpose();
    return {omega + s * alpha, alpha, R_later_body * (v + s * a), R_later_body * a};
  }
};

}  // namespace pangea::vio
