#include "posegraph/solver/group_solver.h"

#include <ceres/ceres.h>
#include <ceres/normal_prior.h>

#include <Eigen/Sparse>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>

#include "posegraph/solver/pose_cost.h"

namespace pangea {
namespace {

constexpr double kOne = 1;
constexpr int kSwitchRounds = 5;
constexpr int kMaxIterations = 30;  // of a solve
// The control parameter of GNC grows by this factor in each step.
constexpr double kGncFactor = 2.0;
constexpr int kMaxGncSteps = 25;

// Weight of a residual under the GNC surrogate with control parameter mu (RA-L 2020, eq. 14).
double GraduatedWeight(double squared_residual, double c2, double mu) {
  if (squared_residual <= mu / (mu + 1) * c2) {
    return 1;
  }
  if (squared_residual >= (mu + 1) / mu * c2) {
    return 0;
  }
  return std::clamp(std::sqrt(c2 / squared_residual * mu * (mu + 1)) - mu, 0.0, 1.0);
}

using SparseFactor = Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>;

// The 4x4 diagonal block at `column` of the inverse of P' L D L' P: it is Y' D^-1 Y with L Y = P e.
// Few rows of Y are not zero: those on the paths of the elimination tree from the four columns to
// the root (Davis, Direct Methods for Sparse Linear Systems, 2006, section 3.2). The four paths
// meet, so these rows lie on one path. A column's parent is its first row below the diagonal.
Matrix4d InverseBlock(const SparseFactor& factor, const Eigen::VectorXd& D, int column) {
  const Eigen::SparseMatrix<double>& L = factor.matrixL().nestedExpression();
  const int size = static_cast<int>(L.cols());
  Eigen::Matrix4Xd Y = Eigen::Matrix4Xd::Zero(4, size);  // transposed
  int j = size;
  for (int k = 0; k < 4; ++k) {
    const int row = factor.permutationP().indices()[column + k];
    Y(k, row) = 1;
    j = std::min(j, row);
  }
  Matrix4d block = Matrix4d::Zero();
  while (j < size) {
    const Vector4d y = Y.col(j);
    block += y * y.transpose() / D[j];
    int parent = size;
    for (Eigen::SparseMatrix<double>::InnerIterator entry(L, j); entry; ++entry) {
      const int row = static_cast<int>(entry.row());
      Y.col(row) -= entry.value() * y;
      parent = std::min(parent, row);
    }
    j = parent;
  }
  return block;
}

// Sigmas of a node that no loop in force connects to a fixed one (m, m, m, rad).
const Vector4d kUnknownSigmas(100, 100, 100, 3.2);

bool IsKnown(const Matrix4d& covariance) {
  return covariance.allFinite() && (covariance.diagonal().array() > 0).all() &&
         (covariance.diagonal().array() <= kUnknownSigmas.array().square()).all();
}

// The blocks at these columns of the inverse of H. False if H is singular, or nearly so.
bool InverseBlocks(const Eigen::SparseMatrix<double>& H, const std::vector<int>& columns,
                   std::vector<Matrix4d>* blocks) {
  const SparseFactor factor(H);
  if (factor.info() != Eigen::Success) {
    return false;
  }
  const Eigen::VectorXd D = factor.vectorD();
  bool known = true;
  for (size_t i = 0; i < columns.size(); ++i) {
    if (columns[i] >= 0) {
      (*blocks)[i] = InverseBlock(factor, D, columns[i]);
      known = known && IsKnown((*blocks)[i]);
    }
  }
  return known;
}

// H with a prior of kUnknownSigmas on each of the first `num_nodes` blocks of four columns.
Eigen::SparseMatrix<double> WithPriors(Eigen::SparseMatrix<double> H, int num_nodes) {
  for (int i = 0; i < 4 * num_nodes; ++i) {
    H.coeffRef(i, i) += 1 / (kUnknownSigmas[i % 4] * kUnknownSigmas[i % 4]);
  }
  return H;
}

}  // namespace

GroupSolver::GroupSolver() : problem_(std::make_unique<ceres::Problem>()) {}

GroupSolver::~GroupSolver() = default;

int GroupSolver::AddNode(const Pose4& pose, bool fixed) {
  nodes_.push_back({pose.p.x(), pose.p.y(), pose.p.z(), pose.yaw});
  fixed_.push_back(fixed);
  problem_->AddParameterBlock(nodes_.back().data(), 4);
  if (fixed) {
    problem_->SetParameterBlockConstant(nodes_.back().data());
  }
  return static_cast<int>(nodes_.size()) - 1;
}

int GroupSolver::AddScale(double log_scale, double sigma) {
  scales_.push_back(log_scale);
  problem_->AddResidualBlock(
      new ceres::NormalPrior(ceres::Matrix::Constant(1, 1, 1 / sigma), ceres::Vector::Zero(1)),
      nullptr, &scales_.back());
  return static_cast<int>(scales_.size()) - 1;
}

void GroupSolver::AddEdge(int from, int to, int scale, const Relative4& relative,
                          const Matrix4d& whitening, const double* sqrt_weight) {
  if (scale == kMetric) {
    problem_->AddResidualBlock(new RelativePoseCost(relative, whitening, sqrt_weight), nullptr,
                               nodes_[from].data(), nodes_[to].data());
  } else {
    problem_->AddResidualBlock(new ScaledPoseCost(relative, whitening, sqrt_weight), nullptr,
                               nodes_[from].data(), nodes_[to].data(), &scales_[scale]);
  }
}

void GroupSolver::AddOdometry(int from, int to, const Relative4& relative, int scale) {
  AddEdge(from, to, scale, relative, Whitening(relative.covariance), &kOne);
}

int GroupSolver::AddLoop(int from, int to, const Relative4& relative, bool on, int scale) {
  loops_.push_back({from, to, scale, relative, Whitening(relative.covariance)});
  Loop& loop = loops_.back();
  SetWeight(&loop, on ? 1 : 0);
  AddEdge(from, to, scale, relative, loop.whitening, &loop.sqrt_weight);
  return static_cast<int>(loops_.size()) - 1;
}

Pose4 GroupSolver::pose(int node) const {
  return {Eigen::Vector3d::Map(nodes_[node].data()), nodes_[node][3]};
}

void GroupSolver::SetWeight(Loop* loop, double weight) {
  loop->weight = weight;
  loop->sqrt_weight = std::sqrt(weight);
}

double GroupSolver::SquaredResidual(const Loop& loop) const {
  const double scale = loop.scale == kMetric ? 1 : std::exp(scales_[loop.scale]);
  return (loop.whitening * Residual(pose(loop.from), pose(loop.to), loop.relative, scale))
      .squaredNorm();
}

void GroupSolver::Minimise(int max_iterations) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.sparse_linear_algebra_library_type = ceres::SUITE_SPARSE;
  options.num_threads = 1;
  options.max_num_iterations = max_iterations;
  // Odometry and alignments give a good initial guess, so almost no damping is needed.
  options.initial_trust_region_radius = 1e8;
  options.function_tolerance = 1e-9;
  options.parameter_tolerance = 1e-10;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, problem_.get(), &summary);
}

void GroupSolver::SolveGraduated() {
  constexpr int kIterationsPerStep = 4;
  const double c2 = kMaxLoopChi2;
  Minimise(kMaxIterations);
  double worst = 0;
  for (const Loop& loop : loops_) {
    worst = std::max(worst, loop.weight * SquaredResidual(loop));
  }
  if (worst > c2) {
    double mu = c2 / (2 * worst - c2);
    for (int step = 0; step < kMaxGncSteps; ++step, mu *= kGncFactor) {
      bool decided = true;
      for (Loop& loop : loops_) {
        SetWeight(&loop, GraduatedWeight(SquaredResidual(loop), c2, mu));
        decided = decided && (loop.weight == 0 || loop.weight == 1);
      }
      Minimise(kIterationsPerStep);
      if (decided && mu > 1) {
        break;
      }
    }
    for (Loop& loop : loops_) {
      SetWeight(&loop, loop.weight > 0.5 ? 1 : 0);
    }
    Minimise(kMaxIterations);
  }
  SwitchUntilStable(std::vector<bool>(loops_.size(), true));
}

void GroupSolver::SolveWarm(const std::vector<bool>& may_go) {
  Minimise(kMaxIterations);
  SwitchUntilStable(may_go);
}

void GroupSolver::SwitchUntilStable(const std::vector<bool>& may_go) {
  for (int round = 0; round < kSwitchRounds; ++round) {
    bool changed = false;
    for (size_t i = 0; i < loops_.size(); ++i) {
      const bool fits = SquaredResidual(loops_[i]) <= kMaxLoopChi2;
      const bool on = loop_on(static_cast<int>(i));
      // Only loops with may_go are switched off, and none in the last round: two may alternate.
      if (fits != on && (!on || (may_go[i] && round < kSwitchRounds - 1))) {
        SetWeight(&loops_[i], fits ? 1 : 0);
        changed = true;
      }
    }
    if (!changed) {
      return;
    }
    Minimise(kMaxIterations);
  }
}

std::vector<Matrix4d> GroupSolver::Marginals(const std::vector<int>& nodes) const {
  std::vector<double*> blocks;
  std::vector<int> column(nodes_.size(), -1);
  for (size_t i = 0; i < nodes_.size(); ++i) {
    if (!fixed_[i]) {
      column[i] = static_cast<int>(4 * blocks.size());
      blocks.push_back(const_cast<double*>(nodes_[i].data()));
    }
  }
  std::vector<Matrix4d> marginals(nodes.size(), Matrix4d::Zero());
  if (blocks.empty()) {
    return marginals;
  }
  const auto num_nodes = static_cast<int>(blocks.size());
  for (const double& scale : scales_) {
    blocks.push_back(const_cast<double*>(&scale));
  }
  ceres::Problem::EvaluateOptions options;
  options.parameter_blocks = blocks;
  ceres::CRSMatrix crs;
  problem_->Evaluate(options, nullptr, nullptr, nullptr, &crs);
  const Eigen::Map<const Eigen::SparseMatrix<double, Eigen::RowMajor>> J(
      crs.num_rows, crs.num_cols, static_cast<int>(crs.values.size()), crs.rows.data(),
      crs.cols.data(), crs.values.data());
  const Eigen::SparseMatrix<double> H = J.transpose() * J;
  std::vector<int> columns;
  for (const int node : nodes) {
    columns.push_back(column[node]);
  }
  // Singular if all loops of a map are switched off.
  if (!InverseBlocks(H, columns, &marginals)) {
    InverseBlocks(WithPriors(H, num_nodes), columns, &marginals);
  }
  return marginals;
}

}  // namespace pangea
