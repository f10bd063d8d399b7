#pragma once

// An odometry edge in a bundle adjustment, with analytic Jacobians by the project's tangent
// (dp, dtheta) in the left frame. Covariance L L^T in from's body frame, kappa the log scale of the
// odometry's metres:
//   kWorld:    r = L^-1 [t_rel - exp(kappa) t; Log(R_rel R^T)]
//   kOdometry: r = L^-1 [exp(-kappa) t_rel - t; Log(R_rel R^T)]
// In the world's metres a scale that only its prior holds would shrink until the residuals are
// nothing.

#include "core/rigid3.h"

namespace pangea {

class EdgeResidual {
 public:
  enum class Metres { kWorld, kOdometry };

  struct Jacobians {
    Matrix6d from, to;  // by the poses
    Vector6d scale;     // by kappa
  };

  EdgeResidual(const Rigid3& T_from_to, const Matrix6d& covariance, Metres metres = Metres::kWorld);
  Vector6d Evaluate(const Rigid3& T_w_from, const Rigid3& T_w_to, double kappa,
                    Jacobians* jacobians = nullptr) const;

 private:
  Rigid3 T_from_to_;
  Matrix6d sqrt_info_;
  Metres metres_;
};

}  // namespace pangea
