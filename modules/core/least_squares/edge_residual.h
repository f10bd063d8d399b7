#pragma once

// Residual of an odometry edge in a bundle adjustment, with analytic Jacobians for the tangent
// (dp, dtheta) in the left frame (core/rigid3.h). (t, R) is the measured edge, (t_rel, R_rel) the
// relative pose of the estimate, L L^T the covariance in from's body frame, kappa the log scale of
// the odometry's lengths:
//   kMap:      r = L^-1 [t_rel - exp(kappa) t; Log(R_rel R^T)]
//   kOdometry: r = L^-1 [exp(-kappa) t_rel - t; Log(R_rel R^T)]
// With kMap, a scale that only its prior determines would shrink until the residuals vanish.

#include "core/rigid3.h"

namespace pangea {

class EdgeResidual {
 public:
  enum class Scale { kMap, kOdometry };

  struct Jacobians {
    Matrix6d from, to;  // d(r)/d(pose)
    Vector6d scale;     // d(r)/d(kappa)
  };

  EdgeResidual(const Rigid3& T_from_to, const Matrix6d& covariance, Scale scale = Scale::kMap);
  Vector6d Evaluate(const Rigid3& T_map_from, const Rigid3& T_map_to, double kappa,
                    Jacobians* jacobians = nullptr) const;

 private:
  Rigid3 T_from_to_;
  Matrix6d sqrt_info_;
  Scale scale_;
};

}  // namespace pangea
