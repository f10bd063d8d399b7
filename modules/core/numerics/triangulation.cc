#include "core/numerics/triangulation.h"

#include <Eigen/Cholesky>

namespace pangea {

using Eigen::Matrix3d;
using Eigen::Vector3d;

std::optional<Vector3d> TriangulateMidpoint(std::span<const LineOfSight> lines) {
  constexpr double kMinPivot = 1e-9;  // below this, all directions agree to about 1e-5 rad
  Matrix3d A = Matrix3d::Zero();
  Vector3d b = Vector3d::Zero();
  for (const auto& [origin, direction] : lines) {
    const Matrix3d across = Matrix3d::Identity() - direction * direction.transpose();
    A += across;
    b += across * origin;
  }
  const Eigen::LDLT<Matrix3d> ldlt(A);
  if (ldlt.info() != Eigen::Success || ldlt.vectorD().minCoeff() < kMinPivot) {
    return std::nullopt;
  }
  return Vector3d(ldlt.solve(b));
}

}  // namespace pangea
