#include "core/least_squares/levenberg_marquardt.h"

#include <Eigen/Cholesky>

namespace pangea {

Eigen::MatrixXd SolveScaled(const Eigen::MatrixXd& H, const Eigen::MatrixXd& b) {
  const Eigen::VectorXd scale = H.diagonal().cwiseMax(1e-12).cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd S = scale.asDiagonal() * H * scale.asDiagonal();
  Eigen::MatrixXd y = scale.asDiagonal() * b;
  const Eigen::LLT<Eigen::MatrixXd> llt(S);
  if (llt.info() == Eigen::Success) {
    llt.solveInPlace(y);
  } else {
    y = S.ldlt().solve(y).eval();  // LDLT pivots: S may be only semidefinite
  }
  return scale.asDiagonal() * y;
}

}  // namespace pangea
