#include "core/axis_aligned.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>

namespace pangea {

std::vector<Eigen::Quaterniond> AxisAlignedRotations() {
  std::vector<Eigen::Quaterniond> rotations;
  for (int x = 0; x < 6; ++x) {
    for (int y = 0; y < 6; ++y) {
      if (x / 2 == y / 2) {
        continue;
      }
      Eigen::Matrix3d R = Eigen::Matrix3d::Zero();
      R(x / 2, 0) = x % 2 == 0 ? 1 : -1;
      R(y / 2, 1) = y % 2 == 0 ? 1 : -1;
      R.col(2) = R.col(0).cross(R.col(1));
      rotations.emplace_back(R);
    }
  }
  return rotations;
}

Eigen::Quaterniond NearestAxisAligned(const Eigen::Quaterniond& q_body_cam) {
  const std::vector<Eigen::Quaterniond> rotations = AxisAlignedRotations();
  return *std::min_element(rotations.begin(), rotations.end(),
                           [&](const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
                             return a.angularDistance(q_body_cam) < b.angularDistance(q_body_cam);
                           });
}

std::string AxesOf(const Eigen::Quaterniond& q_body_cam) {
  const Eigen::Matrix3d R = NearestAxisAligned(q_body_cam).toRotationMatrix();
  std::string axes;
  for (int col = 0; col < 3; ++col) {
    Eigen::Index row = 0;
    R.col(col).cwiseAbs().maxCoeff(&row);
    axes += fmt::format("{}{}{}", col > 0 ? "," : "", R(row, col) < 0 ? "-" : "", "xyz"[row]);
  }
  return axes;
}

}  // namespace pangea
