#pragma once

// Products and solves with matrices of nine columns (a frame's velocity and biases; the blocks in
// which a Cholesky factor is made). Eigen's general ones copy blocks first, which so few columns do
// not repay.

#include <Eigen/Core>

namespace pangea::vio {

using Matrix9d = Eigen::Matrix<double, 9, 9>;
using NineColumns = Eigen::Matrix<double, Eigen::Dynamic, 9>;

// C -= A A^T: the lower triangle of the upper left part that A has rows for.
void SubtractSquare(const NineColumns& A, Eigen::Ref<Eigen::MatrixXd> C);
// C -= A B^T: the upper triangle of C.
void SubtractUpperProduct(const NineColumns& A, const NineColumns& B,
                          Eigen::Ref<Eigen::MatrixXd> C);
// C -= A M^T, in the rows of A.
void SubtractProduct(const NineColumns& A, const Matrix9d& M, NineColumns* C);
// X of X L^T = B, in place of B.
void SolveOnTheRight(const Matrix9d& L, Eigen::Ref<NineColumns> X);
// The Cholesky factor of H, in place of H's lower triangle. False when H is not positive definite.
bool FactoriseInPlace(Eigen::MatrixXd* H);

}  // namespace pangea::vio
