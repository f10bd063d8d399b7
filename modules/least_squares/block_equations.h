#pragma once

// Sparse normal equations H x = -g, H symmetric, of variables of several columns each, by CHOLMOD's
// supernodal Cholesky (Chen et al., ACM TOMS 2008).
//
// What a residual or an eliminated landmark ties together is a clique of variables. Where the
// blocks of each clique are in H is found once; then they are added to in place, in blocks of a
// size that the compiler knows. One thread: the same calls in the same order give the same bytes.

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

namespace pangea {

class BlockEquations {
 public:
  // `sizes`: columns of each variable. A clique is ascending, without repeats.
  BlockEquations(const std::vector<int>& sizes, const std::vector<std::vector<int>>& cliques);
  ~BlockEquations();
  BlockEquations(const BlockEquations&) = delete;
  BlockEquations& operator=(const BlockEquations&) = delete;

  int num_columns() const { return static_cast<int>(g_.size()); }
  // The first column of a variable; of one behind the last, how many columns there are.
  int ColumnOf(int variable) const { return first_column_[variable]; }
  void SetZero();

  // H += block: rows of the clique's member a, columns of its member b, a >= b. Where a is b the
  // lower triangle counts.
  template <typename Block>
  void Add(size_t clique, size_t a, size_t b, const Eigen::MatrixBase<Block>& block) {
    constexpr int kColumns = Block::ColsAtCompileTime;
    // A matrix of one row would be stored by rows.
    constexpr int kRows =
        Block::RowsAtCompileTime == 1 && kColumns != 1 ? Eigen::Dynamic : Block::RowsAtCompileTime;
    const Place& place = places_[first_place_[clique] + a * (a + 1) / 2 + b];
    Eigen::Map<Eigen::Matrix<double, kRows, kColumns>, 0, Eigen::OuterStride<>>(
        H_.valuePtr() + place.value, block.rows(), block.cols(),
        Eigen::OuterStride<>(place.stride)) += block;
  }
  // Its lower triangle counts.
  const Eigen::SparseMatrix<double>& H() const { return H_; }
  Eigen::VectorXd& g() { return g_; }
  const Eigen::VectorXd& g() const { return g_; }

  // Adds a share of the diagonal to it (Marquardt 1963).
  void Damp(double share);
  // x; nothing if H is not positive definite.
  std::optional<Eigen::VectorXd> Solve();

 private:
  // Of a block in the values of H: its first, and from one of its columns to the next.
  struct Place {
    int value = 0, stride = 0;
  };
  struct Factor;

  void FindPlaces(const std::vector<std::vector<int>>& cliques);

  std::vector<int> first_column_;
  std::vector<size_t> first_place_;  // of each clique
  std::vector<Place> places_;
  // By columns, the lower triangle, and of a variable with itself all.
  Eigen::SparseMatrix<double> H_;
  Eigen::VectorXd g_;
  std::unique_ptr<Factor> factor_;
};

}  // namespace pangea
