#include "block_equations/block_equations.h"

#include <dlfcn.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <atomic>
#include <limits>
#include <random>
#include <thread>

// Stands before OpenBLAS' function of this name, and before none if this machine has another BLAS.
static std::atomic<int> openblas_threads = 0;
extern "C" void openblas_set_num_threads(int threads) { openblas_threads = threads; }

namespace pangea {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

const std::vector<int> kSizes{6, 9, 1, 6, 3, 9};
const std::vector<std::vector<int>> kCliques{{0, 1, 3}, {2, 4}, {1, 2, 5}, {5}, {0, 4}, {}};

MatrixXd Random(int rows, int columns, std::mt19937_64* rng) {
  std::normal_distribution<double> normal(0, 1);
  return MatrixXd::NullaryExpr(rows, columns, [&] { return normal(*rng); });
}

// Adds residuals of each clique to the sparse and to dense equations.
struct Both {
  BlockEquations sparse{kSizes, kCliques};
  MatrixXd H;
  VectorXd g;

  void Fill(uint64_t seed) {
    std::mt19937_64 rng(seed);
    sparse.SetZero();
    H = MatrixXd::Zero(sparse.num_columns(), sparse.num_columns());
    g = VectorXd::Zero(sparse.num_columns());
    for (size_t clique = 0; clique < kCliques.size(); ++clique) {
      AddClique(clique, &rng);
    }
  }

  void AddClique(size_t clique, std::mt19937_64* rng) {
    const std::vector<int>& members = kCliques[clique];
    const VectorXd r = Random(20, 1, rng);
    std::vector<MatrixXd> J;
    for (const int variable : members) {
      J.push_back(Random(20, kSizes[variable], rng));
    }
    for (size_t a = 0; a < members.size(); ++a) {
      const int row = sparse.ColumnOf(members[a]), rows = kSizes[members[a]];
      sparse.g().segment(row, rows) += J[a].transpose() * r;
      g.segment(row, rows) += J[a].transpose() * r;
      for (size_t b = 0; b < members.size(); ++b) {
        const MatrixXd block = J[a].transpose() * J[b];
        H.block(row, sparse.ColumnOf(members[b]), rows, block.cols()) += block;
        if (b <= a) {
          sparse.Add(clique, a, b, block);
        }
      }
    }
  }
};

TEST(BlockEquations, SolvesAsDenseOnesDo) {
  Both both;
  EXPECT_EQ(both.sparse.num_columns(), 34);
  for (uint64_t seed = 1; seed <= 3; ++seed) {
    both.Fill(seed);
    const auto x = both.sparse.Solve();
    ASSERT_TRUE(x);
    EXPECT_LT((*x + both.H.llt().solve(both.g)).norm(), 1e-10 * x->norm());
  }
}

TEST(BlockEquations, AFactorSolvesForOtherGradientsAndGivesBlocksOfTheInverse) {
  Both both;
  both.Fill(5);
  ASSERT_TRUE(both.sparse.Factorise());
  both.sparse.SetZero();
  std::mt19937_64 rng(6);
  both.sparse.g() = Random(both.sparse.num_columns(), 1, &rng);
  const VectorXd x = both.sparse.SolveFactorised();
  EXPECT_LT((x + both.H.llt().solve(both.sparse.g())).norm(), 1e-10 * x.norm());
  const MatrixXd inverse = both.H.inverse();
  for (size_t i = 0; i < kSizes.size(); ++i) {
    const int column = both.sparse.ColumnOf(static_cast<int>(i));
    const MatrixXd block = inverse.block(column, column, kSizes[i], kSizes[i]);
    EXPECT_LT((both.sparse.InverseBlock(static_cast<int>(i)) - block).norm(), 1e-10 * block.norm());
  }
}

TEST(BlockEquations, DampsTheDiagonal) {
  Both both;
  both.Fill(4);
  both.sparse.Damp(0.5);
  both.H.diagonal() *= 1.5;
  const auto x = both.sparse.Solve();
  ASSERT_TRUE(x);
  EXPECT_LT((*x + both.H.llt().solve(both.g)).norm(), 1e-10 * x->norm());
}

// Eigen stores a matrix with one row in row-major order.
TEST(BlockEquations, TakesABlockOfOneRow) {
  BlockEquations equations({2, 1}, {{0, 1}});
  equations.Add(0, 0, 0, Eigen::Matrix2d::Identity());
  equations.Add(0, 1, 0, Eigen::RowVector2d(0.5, -0.25));
  equations.Add(0, 1, 1, Eigen::Matrix<double, 1, 1>(1));
  equations.g() << 1, 2, 3;
  Eigen::Matrix3d H;
  H << 1, 0, 0.5, 0, 1, -0.25, 0.5, -0.25, 1;
  const auto x = equations.Solve();
  ASSERT_TRUE(x);
  EXPECT_LT((*x + H.llt().solve(equations.g())).norm(), 1e-12);
}

TEST(BlockEquations, HasNoSolutionWhereAVariableIsFree) {
  BlockEquations equations({2, 2}, {{0}, {1}});
  equations.Add(0, 0, 0, Eigen::Matrix2d::Identity());
  EXPECT_FALSE(equations.Solve());
  equations.Add(1, 0, 0, Eigen::Matrix2d::Identity());
  EXPECT_TRUE(equations.Solve());
}

TEST(BlockEquations, HaveNoFactorWithANumberThatIsNone) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  BlockEquations equations({1, 1}, {{0, 1}});
  const auto add = [&equations](size_t a, size_t b, double value) {
    equations.Add(0, a, b, Eigen::Matrix<double, 1, 1>(value));
  };
  add(0, 0, 1);
  add(1, 1, 1);
  EXPECT_TRUE(equations.Factorise());
  add(1, 0, nan);
  EXPECT_FALSE(equations.Factorise());
}

// CHOLMOD links OpenMP, and its code requests four threads in this way. A thread of its own: what
// OpenMP may do is said thread by thread.
TEST(BlockEquations, SolveInOneThreadWhateverALibraryAsksFor) {
  using Region = void (*)(void*);
  void* const symbol = dlsym(RTLD_DEFAULT, "GOMP_parallel");
  ASSERT_NE(symbol, nullptr);
  const auto parallel = reinterpret_cast<void (*)(Region, void*, unsigned, unsigned)>(symbol);
  std::atomic<int> entered = 0;
  std::thread([&] {
    const Region enter = [](void* count) { ++*static_cast<std::atomic<int>*>(count); };
    parallel(enter, &entered, 4, 0);
    EXPECT_EQ(entered.exchange(0), 4);
    openblas_threads = 0;
    const BlockEquations equations({1}, {{0}});
    parallel(enter, &entered, 4, 0);
  }).join();
  EXPECT_EQ(entered, 1);
  EXPECT_EQ(openblas_threads, 1);
}

TEST(BlockEquations, NoVariablesHaveASolution) {
  BlockEquations equations({}, {{}, {}});
  const auto x = equations.Solve();
  ASSERT_TRUE(x);
  EXPECT_EQ(x->size(), 0);
}

}  // namespace
}  // namespace pangea
