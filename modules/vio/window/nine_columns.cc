#include "vio/window/nine_columns.h"

#include <Eigen/Cholesky>
#include <array>

#include "vio/vector_clones.h"

namespace pangea::vio {
namespace {

constexpr int kColumns = 9;

// to -= A * weights, for the rows `begin` to `end`.
[[gnu::always_inline]] inline void SubtractWeighted(const NineColumns& A,
                                                    const std::array<double, kColumns>& weights,
                                                    Eigen::Index begin, Eigen::Index end,
                                                    double* __restrict to) {
  const Eigen::Index stride = A.rows();
  const double* const columns = A.data();
  for (Eigen::Index row = begin; row < end; ++row) {
    double sum = 0;
    for (int k = 0; k < kColumns; ++k) {
      sum += weights[k] * columns[k * stride + row];
    }
    to[row] -= sum;
  }
}

}  // namespace

PANGEA_VECTOR_CLONES
void SubtractSquare(const NineColumns& A, Eigen::Ref<Eigen::MatrixXd> C) {
  for (Eigen::Index column = 0; column < A.rows(); ++column) {
    std::array<double, kColumns> weights;
    for (int k = 0; k < kColumns; ++k) {
      weights[k] = A(column, k);
    }
    SubtractWeighted(A, weights, column, A.rows(), C.data() + column * C.outerStride());
  }
}

PANGEA_VECTOR_CLONES
void SubtractUpperProduct(const NineColumns& A, const NineColumns& B,
                          Eigen::Ref<Eigen::MatrixXd> C) {
  for (Eigen::Index column = 0; column < B.rows(); ++column) {
    std::array<double, kColumns> weights;
    for (int k = 0; k < kColumns; ++k) {
      weights[k] = B(column, k);
    }
    SubtractWeighted(A, weights, 0, column + 1, C.data() + column * C.outerStride());
  }
}

PANGEA_VECTOR_CLONES
void SubtractProduct(const NineColumns& A, const Matrix9d& M, NineColumns* C) {
  for (int column = 0; column < kColumns; ++column) {
    std::array<double, kColumns> weights;
    for (int k = 0; k < kColumns; ++k) {
      weights[k] = M(column, k);
    }
    SubtractWeighted(A, weights, 0, A.rows(), C->data() + column * C->rows());
  }
}

PANGEA_VECTOR_CLONES
void SolveOnTheRight(const Matrix9d& L, Eigen::Ref<NineColumns> X) {
  const Eigen::Index rows = X.rows(), stride = X.outerStride();
  for (int column = 0; column < kColumns; ++column) {
    double* const x = X.data() + column * stride;
    for (Eigen::Index row = 0; row < rows; ++row) {
      x[row] /= L(column, column);
    }
    for (int later = column + 1; later < kColumns; ++later) {
      double* __restrict const y = X.data() + later * stride;
      const double weight = L(later, column);
      for (Eigen::Index row = 0; row < rows; ++row) {
        y[row] -= weight * x[row];
      }
    }
  }
}

bool FactoriseInPlace(Eigen::MatrixXd* H) {
  const Eigen::Index size = H->rows();
  Eigen::Index done = 0;
  for (; done + kColumns < size; done += kColumns) {
    const Eigen::LLT<Matrix9d> own(H->block<kColumns, kColumns>(done, done));
    if (own.info() != Eigen::Success) {
      return false;
    }
    H->block<kColumns, kColumns>(done, done) = own.matrixLLT();
    const Eigen::Index left = size - done - kColumns;
    NineColumns below = H->block<Eigen::Dynamic, kColumns>(done + kColumns, done, left, kColumns);
    SolveOnTheRight(own.matrixLLT(), below);
    SubtractSquare(below, H->bottomRightCorner(left, left));
    H->block<Eigen::Dynamic, kColumns>(done + kColumns, done, left, kColumns) = below;
  }
  const Eigen::LLT<Eigen::MatrixXd> last(H->bottomRightCorner(size - done, size - done));
  H->bottomRightCorner(size - done, size - done) = last.matrixLLT();
  return last.info() == Eigen::Success;
}

}  // namespace pangea::vio
