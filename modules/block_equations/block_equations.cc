#include "block_equations/block_equations.h"

#include <Eigen/CholmodSupport>
#include <algorithm>

#include "blas/blas.h"

namespace pangea {
namespace {

// A variable's position in a clique.
struct Use {
  size_t clique = 0, member = 0;
};

std::vector<std::vector<Use>> UsesOf(size_t num_variables,
                                     const std::vector<std::vector<int>>& cliques) {
  std::vector<std::vector<Use>> uses(num_variables);
  for (size_t clique = 0; clique < cliques.size(); ++clique) {
    for (size_t member = 0; member < cliques[clique].size(); ++member) {
      uses[cliques[clique][member]].push_back({clique, member});
    }
  }
  return uses;
}

// The variable and the later ones that share a clique with it, ascending. `last_seen_by`: per
// variable, the last variable whose neighbour it was found to be.
std::vector<int> NeighboursBehind(int variable, const std::vector<Use>& uses,
                                  const std::vector<std::vector<int>>& cliques,
                                  std::vector<int>* last_seen_by) {
  std::vector<int> beside{variable};
  for (const auto& [clique, member] : uses) {
    for (size_t a = member + 1; a < cliques[clique].size(); ++a) {
      if (const int other = cliques[clique][a]; (*last_seen_by)[other] != variable) {
        (*last_seen_by)[other] = variable;
        beside.push_back(other);
      }
    }
  }
  std::ranges::sort(beside);
  return beside;
}

}  // namespace

struct BlockEquations::Factor {
  struct Cholesky : Eigen::CholmodSupernodalLLT<Eigen::SparseMatrix<double>, Eigen::Lower> {
    const cholmod_factor& L() const { return *m_cholmodFactor; }
  };
  Cholesky cholesky;
  std::vector<int> row_of;  // of L, by column of H
};

BlockEquations::BlockEquations(const std::vector<int>& sizes,
                               const std::vector<std::vector<int>>& cliques)
    : first_column_{0}, factor_(std::make_unique<Factor>()) {
  UseOneThread();
  for (const int size : sizes) {
    first_column_.push_back(first_column_.back() + size);
  }
  g_.setZero(first_column_.back());
  FindPlaces(cliques);
  cholmod_common& cholmod = factor_->cholesky.cholmod();
  cholmod.print = 0;
  cholmod.nmethods = 1;
  cholmod.method[0].ordering = CHOLMOD_AMD;
  if (num_columns() > 0) {
    factor_->cholesky.analyzePattern(H_);
    const auto* const column_of = static_cast<const int*>(factor_->cholesky.L().Perm);
    factor_->row_of.resize(num_columns());
    for (int row = 0; row < num_columns(); ++row) {
      factor_->row_of[column_of[row]] = row;
    }
  }
}

BlockEquations::~BlockEquations() = default;

void BlockEquations::FindPlaces(const std::vector<std::vector<int>>& cliques) {
  size_t num_places = 0;
  for (const std::vector<int>& clique : cliques) {
    first_place_.push_back(num_places);
    num_places += clique.size() * (clique.size() + 1) / 2;
  }
  places_.resize(num_places);
  const int num_variables = static_cast<int>(first_column_.size()) - 1;
  const std::vector<std::vector<Use>> uses = UsesOf(num_variables, cliques);
  std::vector<int> column_begin{0}, rows;
  std::vector<int> last_seen_by(num_variables, -1), offset(num_variables);
  for (int variable = 0; variable < num_variables; ++variable) {
    std::vector<int> rows_of_one;
    for (const int other : NeighboursBehind(variable, uses[variable], cliques, &last_seen_by)) {
      offset[other] = static_cast<int>(rows_of_one.size());
      for (int row = first_column_[other]; row < first_column_[other + 1]; ++row) {
        rows_of_one.push_back(row);
      }
    }
    const auto stride = static_cast<int>(rows_of_one.size());
    for (const auto& [clique, member] : uses[variable]) {
      for (size_t a = member; a < cliques[clique].size(); ++a) {
        places_[first_place_[clique] + a * (a + 1) / 2 + member] = {
            column_begin.back() + offset[cliques[clique][a]], stride};
      }
    }
    for (int column = first_column_[variable]; column < first_column_[variable + 1]; ++column) {
      rows.insert(rows.end(), rows_of_one.begin(), rows_of_one.end());
      column_begin.push_back(static_cast<int>(rows.size()));
    }
  }
  H_.resize(num_columns(), num_columns());
  H_.resizeNonZeros(static_cast<Eigen::Index>(rows.size()));
  std::ranges::copy(column_begin, H_.outerIndexPtr());
  std::ranges::copy(rows, H_.innerIndexPtr());
  SetZero();
}

void BlockEquations::SetZero() {
  H_.coeffs().setZero();
  g_.setZero();
}

void BlockEquations::Damp(double share) {
  constexpr double kLeast = 1e-6;  // for a column without information
  for (size_t variable = 0; variable + 1 < first_column_.size(); ++variable) {
    // A variable's own rows come first in its columns.
    for (int column = first_column_[variable]; column < first_column_[variable + 1]; ++column) {
      const int row = column - first_column_[variable];
      double& value = H_.valuePtr()[H_.outerIndexPtr()[column] + row];
      value += share * std::max(kLeast, value);
    }
  }
}

bool BlockEquations::Factorise() {
  if (num_columns() == 0) {
    return true;
  }
  // OpenBLAS' dpotrf takes a NaN for positive, which LAPACK's and ATLAS' refuse.
  if (!H_.coeffs().allFinite()) {
    return false;
  }
  factor_->cholesky.factorize(H_);
  return factor_->cholesky.info() == Eigen::Success;
}

Eigen::VectorXd BlockEquations::SolveFactorised() const {
  return num_columns() == 0 ? Eigen::VectorXd() : Eigen::VectorXd(factor_->cholesky.solve(-g_));
}

std::optional<Eigen::VectorXd> BlockEquations::Solve() {
  if (!Factorise()) {
    return std::nullopt;
  }
  Eigen::VectorXd x = SolveFactorised();
  return x.allFinite() ? std::make_optional(std::move(x)) : std::nullopt;
}

// With P H P' = L L' it is Y' Y, L Y = P E, E: the variable's columns of the identity. Few rows of
// Y are not zero: those on the paths of the elimination tree from the variable's columns to the
// root (Davis, Direct Methods for Sparse Linear Systems, 2006, section 3.2). The columns are a
// clique, so their paths are one. A supernode's parent has its first row below the diagonal block.
Eigen::MatrixXd BlockEquations::InverseBlock(int variable) const {
  using Eigen::Map, Eigen::MatrixXd, Eigen::OuterStride;
  const cholmod_factor& L = factor_->cholesky.L();
  const auto* super = static_cast<const int*>(L.super);
  const auto* row_begin = static_cast<const int*>(L.pi);
  const auto* value_begin = static_cast<const int*>(L.px);
  const auto* rows = static_cast<const int*>(L.s);
  const int size = ColumnOf(variable + 1) - ColumnOf(variable);
  MatrixXd Y = MatrixXd::Zero(num_columns(), size);
  int next = num_columns();
  for (int k = 0; k < size; ++k) {
    const int row = factor_->row_of[ColumnOf(variable) + k];
    Y(row, k) = 1;
    next = std::min(next, row);
  }
  MatrixXd block = MatrixXd::Zero(size, size);
  while (next < num_columns()) {
    const auto node = std::upper_bound(super, super + L.nsuper, next) - super - 1;
    const int count = super[node + 1] - super[node];
    const int num_rows = row_begin[node + 1] - row_begin[node];
    const Map<const MatrixXd, 0, OuterStride<>> values(
        static_cast<const double*>(L.x) + value_begin[node], num_rows, count,
        OuterStride<>(num_rows));
    auto y = Y.middleRows(super[node], count);
    values.topRows(count).triangularView<Eigen::Lower>().solveInPlace(y);
    block.noalias() += y.transpose() * y;
    const MatrixXd below = values.bottomRows(num_rows - count) * y;
    const int* const rows_below = rows + row_begin[node] + count;
    for (int i = 0; i < num_rows - count; ++i) {
      Y.row(rows_below[i]) -= below.row(i);
    }
    next = num_rows > count ? rows_below[0] : num_columns();
  }
  return block;
}

}  // namespace pangea
