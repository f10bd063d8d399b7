#pragma once

// Products and solves with matrices of nine columns (a frame's velocity and biases; the blocks in
// which a Cholesky factor is made). Eigen's general products copy blocks first, which does not pay
// with so few columns.

#include <Eigen/Core>

namespace pangea::vio {

using Matrix9d = Eigen::Matrix<double, 9, 9>;
using NineColumns = Eigen::Matrix<double, Eigen::Dynamic, 9>;

// C -= A A^T, in the lower triangle of the top left block of C with as many rows as A.
void SubtractSquare(const NineColumns& A, Eigen::Ref<Eigen::MatrixXd> C);
// C -= A B^T, in the upper triangle of C.
void SubtractUpperProduct(const NineColumns& A, const NineColumns& B,
                          Eigen::Ref<Eigen::MatrixXd> C);
// C -= A M^T, in the first rows of C, as many as A has.
void SubtractProduct(const NineColumns& A, const Matrix9d& M, NineColumns* C);
// Solves X L^T = B in place: B becomes X.
void SolveOnTheRight(const Matrix9d& L, Eigen::Ref<NineColumns> X);
// Writes the Cholesky factor of H into its lower triangle. False if H is not positive definite.
bool FactoriseInPlace(Eigen::MatrixXd* H);

}  // namespace pangea::vio
