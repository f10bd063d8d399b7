#include "loop_verification/steps/views.h"

#include <algorithm>
#include <cmath>

namespace pangea {

std::string CheckViews(const ViewOptions& options, Verification* verification) {
  const auto& [m, c] = verification->windows;
  const Rigid3& T_m_c = verification->T_m_c();
  const Eigen::Vector3d axis_m = m.T_w_cam.back().q * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d axis_c = T_m_c.q * (c.T_w_cam.back().q * Eigen::Vector3d::UnitZ());
  const double angle = std::acos(std::clamp(axis_m.dot(axis_c), -1.0, 1.0));
  const bool alike = verification->AtMost("max_view_angle", angle, options.max_view_angle);
  const bool near = verification->AtMost("max_distance_m", T_m_c.t.norm(), options.max_distance_m);
  return alike && near ? "" : "views do not overlap";
}

}  // namespace pangea
