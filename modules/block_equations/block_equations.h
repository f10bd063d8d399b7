#pragma once

// Sparse normal equations H x = -g, H symmetric, for variables with several columns each, solved by
// CHOLMOD's supernodal Cholesky (Chen et al., ACM TOMS 2008).
//
// The variables of one residual or one eliminated landmark form a clique. The positions of each
// clique's blocks in H are computed once; then values are added in place, in blocks of a size known
// to the compiler. One thread: the same calls in the same order give the same bytes.

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

namespace pangea {

class BlockEquations {
 public:
  // `sizes`: number of columns of each variable. Each clique is ascending, without repeats.
  BlockEquations(const std::vector<int>& sizes, const std::vector<std::vector<int>>& cliques);
  ~BlockEquations();
  BlockEquations(const BlockEquations&) = delete;
  BlockEquations& operator=(const BlockEquations&) = delete;

  int num_columns() const { return static_cast<int>(g_.size()); }
  // First column of a variable; for the index after the last one, the number of columns.
  int ColumnOf(int variable) const { return first_column_[variable]; }
  void SetZero();

  // H += block, in the rows of the clique's member a and the columns of its member b, a >= b. If a
  // == b, only the lower triangle is used.
  template <typename Block>
  void Add(size_t clique, size_t a, size_t b, const Eigen::MatrixBase<Block>& block) {
    constexpr int kColumns = Block::ColsAtCompileTime;
    // Eigen would store a matrix with one row in row-major order.
    constexpr int kRows =
        Block::RowsAtCompileTime == 1 && kColumns != 1 ? Eigen::Dynamic : Block::RowsAtCompileTime;
    const Place& place = places_[first_place_[clique] + a * (a + 1) / 2 + b];
    Eigen::Map<Eigen::Matrix<double, kRows, kColumns>, 0, Eigen::OuterStride<>>(
        H_.valuePtr() + place.value, block.rows(), block.cols(),
        Eigen::OuterStride<>(place.stride)) += block;
  }
  // Only the lower triangle is valid.
  const Eigen::SparseMatrix<double>& H() const { return H_; }
  Eigen::VectorXd& g() { return g_; }
  const Eigen::VectorXd& g() const { return g_; }

  // Adds `share` times the diagonal to the diagonal (Marquardt 1963).
  void Damp(double share);
  // Returns x; empty if H is not positive definite.
  std::optional<Eigen::VectorXd> Solve();
  // The parts of Solve, to use one factor several times. False if H is not positive definite; then
  // there is no factor.
  bool Factorise();
  // x for the present g, with the H of the last Factorise.
  Eigen::VectorXd SolveFactorised() const;
  // The diagonal block of a variable in the inverse of that H.
  Eigen::MatrixXd InverseBlock(int variable) const;

 private:
  // Position of a block in the values of H: first value, and stride between its columns.
  struct Place {
    int value = 0, stride = 0;
  };
  struct Factor;

  void FindPlaces(const std::vector<std::vector<int>>& cliques);

  std::vector<int> first_column_;
  std::vector<size_t> first_place_;  // by clique
  std::vector<Place> places_;
  // Column-major; the lower triangle, and the full diagonal blocks.
  Eigen::SparseMatrix<double> H_;
  Eigen::VectorXd g_;
  std::unique_ptr<Factor> factor_;
};

}  // namespace pangea
