#pragma once

// The residual of one edge of the pose graph, with its Jacobians.
//
//   r = W [ exp(-kappa) Rz(yaw_i)^T (p_j - p_i) - t ;  wrap(yaw_j - yaw_i - yaw) ],   W = L^T
//   (Whitening)
//
// where one unit of the measurement is exp(kappa) metres of the map; kappa = 0 if it is metric.
// With d = exp(-kappa) Rz(yaw_i)^T (p_j - p_i): dr/dp_j = W exp(-kappa) Rz^T = -dr/dp_i,
// dd/dyaw_i = -z x d = (d.y, -d.x, 0), dd/dkappa = -d.

#include "posegraph/solver/four_dof.h"

namespace pangea {

class PoseCost {
 public:
  explicit PoseCost(const Relative4& measured)
      : measured_(measured), whitening_(Whitening(measured.covariance)) {}

  // With respect to (x, y, z, yaw) of both poses, and to kappa.
  struct Jacobians {
    Matrix4d from, to;
    Vector4d log_scale;
  };
  Vector4d Residual(const Pose4& from, const Pose4& to, double log_scale) const;
  Vector4d Linearise(const Pose4& from, const Pose4& to, double log_scale, Jacobians* J) const;

 private:
  Relative4 measured_;
  Matrix4d whitening_;
};

}  // namespace pangea
