#include "posegraph/solver/group_solver.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace pangea {
namespace {

constexpr int kSwitchRounds = 5;
constexpr int kMaxIterations = 30;  // of a solve
// The control parameter of GNC grows by this factor in each step.
constexpr double kGncFactor = 2.0;
constexpr int kMaxGncSteps = 25;

// A minimum is reached when a step would reduce the cost by no more than this.
constexpr double kTolerance = 1e-9;  // of the cost
constexpr double kLeastDecrease = 1e-14;
// Shares of the diagonal: the least only holds what no loop in force connects to a fixed node.
constexpr double kLeastDamping = 1e-12, kFirstDamping = 1e-6, kDampingFactor = 10;

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

// Sigmas of a node that no loop in force connects to a fixed one (m, m, m, rad).
const Vector4d kUnknownSigmas(100, 100, 100, 3.2);

bool IsKnown(const Matrix4d& covariance) {
  return covariance.allFinite() && (covariance.diagonal().array() > 0).all() &&
         (covariance.diagonal().array() <= kUnknownSigmas.array().square()).all();
}

}  // namespace

int GroupSolver::AddNode(const Pose4& pose, bool fixed) {
  state_.poses.push_back(pose);
  fixed_.push_back(fixed);
  return static_cast<int>(fixed_.size()) - 1;
}

int GroupSolver::AddScale(double log_scale, double sigma) {
  state_.log_scales.push_back(log_scale);
  scale_sigmas_.push_back(sigma);
  return static_cast<int>(scale_sigmas_.size()) - 1;
}

int GroupSolver::AddEdge(const Edge& edge) {
  edges_.push_back(edge);
  return static_cast<int>(edges_.size()) - 1;
}

void GroupSolver::AddOdometry(int from, int to, const Relative4& relative, int scale) {
  AddEdge({from, to, scale, PoseCost(relative)});
}

int GroupSolver::AddLoop(int from, int to, const Relative4& relative, bool on, int scale) {
  loops_.push_back(AddEdge({from, to, scale, PoseCost(relative), on ? 1.0 : 0.0}));
  return static_cast<int>(loops_.size()) - 1;
}

void GroupSolver::Begin() {
  std::vector<int> sizes;
  for (const bool fixed : fixed_) {
    variable_.push_back(fixed ? kFixed : static_cast<int>(sizes.size()));
    if (!fixed) {
      sizes.push_back(4);
    }
  }
  const auto first_scale = static_cast<int>(sizes.size());
  sizes.resize(sizes.size() + scale_sigmas_.size(), 1);
  std::vector<std::vector<int>> cliques;
  for (const Edge& edge : edges_) {
    std::vector<int>& clique = cliques.emplace_back();
    const auto [first, second] = std::minmax(edge.from, edge.to);
    for (const int node : {first, second}) {
      if (variable_[node] != kFixed) {
        clique.push_back(variable_[node]);
      }
    }
    if (edge.scale != kMetric) {
      clique.push_back(first_scale + edge.scale);
    }
  }
  for (int variable = 0; variable < static_cast<int>(sizes.size()); ++variable) {
    cliques.push_back({variable});
  }
  equations_ = std::make_unique<BlockEquations>(sizes, cliques);
}

double GroupSolver::SquaredResidual(const Edge& edge, const State& state) const {
  const double log_scale = edge.scale == kMetric ? 0 : state.log_scales[edge.scale];
  return edge.cost.Residual(state.poses[edge.from], state.poses[edge.to], log_scale).squaredNorm();
}

double GroupSolver::CostOf(const State& state) const {
  double squared = 0;
  for (const Edge& edge : edges_) {
    squared += edge.weight > 0 ? edge.weight * SquaredResidual(edge, state) : 0;
  }
  for (size_t i = 0; i < scale_sigmas_.size(); ++i) {
    const double r = state.log_scales[i] / scale_sigmas_[i];
    squared += r * r;
  }
  return 0.5 * squared;
}

void GroupSolver::AddToEquations(size_t index) const {
  const Edge& edge = edges_[index];
  const double log_scale = edge.scale == kMetric ? 0 : state_.log_scales[edge.scale];
  PoseCost::Jacobians J;
  const Vector4d r =
      edge.cost.Linearise(state_.poses[edge.from], state_.poses[edge.to], log_scale, &J);
  Eigen::VectorXd& g = equations_->g();
  std::array<std::pair<int, const Matrix4d*>, 2> ends{{{edge.from, &J.from}, {edge.to, &J.to}}};
  if (edge.from > edge.to) {
    std::swap(ends[0], ends[1]);
  }
  std::array<const Matrix4d*, 2> free{};
  size_t num_free = 0;
  for (const auto& [node, J_node] : ends) {
    if (variable_[node] == kFixed) {
      continue;
    }
    const Matrix4d weighted = edge.weight * J_node->transpose();
    g.segment<4>(equations_->ColumnOf(variable_[node])) += weighted * r;
    free[num_free] = J_node;
    for (size_t k = 0; k <= num_free; ++k) {
      equations_->Add(index, num_free, k, weighted * *free[k]);
    }
    ++num_free;
  }
  if (edge.scale != kMetric) {
    const Eigen::RowVector4d weighted = edge.weight * J.log_scale.transpose();
    const auto num_scales = static_cast<int>(scale_sigmas_.size());
    g[equations_->num_columns() - num_scales + edge.scale] += weighted * r;
    for (size_t k = 0; k < num_free; ++k) {
      equations_->Add(index, num_free, k, weighted * *free[k]);
    }
    equations_->Add(index, num_free, num_free, Eigen::Matrix<double, 1, 1>(weighted * J.log_scale));
  }
}

void GroupSolver::Linearise() const {
  equations_->SetZero();
  for (size_t i = 0; i < edges_.size(); ++i) {
    if (edges_[i].weight > 0) {
      AddToEquations(i);
    }
  }
  const size_t num_scales = scale_sigmas_.size();
  const size_t first_clique = edges_.size() + std::ranges::count(fixed_, false);
  for (size_t i = 0; i < num_scales; ++i) {
    const double information = 1 / (scale_sigmas_[i] * scale_sigmas_[i]);
    equations_->Add(first_clique + i, 0, 0, Eigen::Matrix<double, 1, 1>(information));
    equations_->g()[equations_->num_columns() - num_scales + i] +=
        information * state_.log_scales[i];
  }
}

GroupSolver::State GroupSolver::MovedBy(const Eigen::VectorXd& step) const {
  State moved = state_;
  for (size_t node = 0; node < fixed_.size(); ++node) {
    if (!fixed_[node]) {
      const auto by = step.segment<4>(equations_->ColumnOf(variable_[node]));
      moved.poses[node].p += by.head<3>();
      moved.poses[node].yaw += by[3];
    }
  }
  const size_t num_scales = scale_sigmas_.size();
  for (size_t i = 0; i < num_scales; ++i) {
    moved.log_scales[i] += step[equations_->num_columns() - num_scales + i];
  }
  return moved;
}

bool GroupSolver::Factorise(double damping) {
  Linearise();
  equations_->Damp(damping);
  const bool factorised = equations_->Factorise();
  factor_damping_ = factorised ? damping : kNoFactor;
  return factorised;
}

// A factor serves for several steps: near the minimum the cost is nearly quadratic, and a step
// takes a fraction of the time of a factor.
void GroupSolver::Minimise(int max_iterations) {
  constexpr double kMinContraction = 0.1;  // of the predicted decrease, from step to step
  if (equations_ == nullptr) {
    Begin();
  }
  double cost = CostOf(state_), damping = kLeastDamping;
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    bool factorised = Factorise(damping);
    for (double last = std::numeric_limits<double>::infinity(); factorised; Linearise()) {
      const Eigen::VectorXd step = equations_->SolveFactorised();
      const double decrease = -0.5 * equations_->g().dot(step);
      if (decrease <= kTolerance * cost + kLeastDecrease) {
        return;
      }
      if (decrease > kMinContraction * last) {
        break;
      }
      State moved = MovedBy(step);
      const double moved_cost = CostOf(moved);
      if (!(moved_cost < cost)) {
        factorised = std::isfinite(last);
        break;
      }
      state_ = std::move(moved);
      cost = moved_cost;
      last = decrease;
    }
    damping = factorised ? kLeastDamping : std::max(kFirstDamping, kDampingFactor * damping);
  }
}

void GroupSolver::SolveGraduated() {
  constexpr int kIterationsPerStep = 4;
  const double c2 = kMaxLoopChi2;
  Minimise(kMaxIterations);
  double worst = 0;
  for (const int loop : loops_) {
    worst = std::max(worst, edges_[loop].weight * SquaredResidual(edges_[loop], state_));
  }
  if (worst > c2) {
    double mu = c2 / (2 * worst - c2);
    for (int step = 0; step < kMaxGncSteps; ++step, mu *= kGncFactor) {
      bool decided = true;
      for (const int loop : loops_) {
        double& weight = edges_[loop].weight;
        weight = GraduatedWeight(SquaredResidual(edges_[loop], state_), c2, mu);
        decided = decided && (weight == 0 || weight == 1);
      }
      Minimise(kIterationsPerStep);
      if (decided && mu > 1) {
        break;
      }
    }
    for (const int loop : loops_) {
      edges_[loop].weight = edges_[loop].weight > 0.5 ? 1 : 0;
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
      Edge& loop = edges_[loops_[i]];
      const bool fits = SquaredResidual(loop, state_) <= kMaxLoopChi2;
      const bool on = loop_on(static_cast<int>(i));
      // Only loops with may_go are switched off, and none in the last round: two may alternate.
      if (fits != on && (!on || (may_go[i] && round < kSwitchRounds - 1))) {
        loop.weight = fits ? 1 : 0;
        changed = true;
      }
    }
    if (!changed) {
      return;
    }
    Minimise(kMaxIterations);
  }
}

// False if a node is not known, or nearly so.
bool GroupSolver::InverseBlocks(const std::vector<int>& nodes,
                                std::vector<Matrix4d>* blocks) const {
  bool known = true;
  for (size_t i = 0; i < nodes.size(); ++i) {
    if (!fixed_[nodes[i]]) {
      (*blocks)[i] = equations_->InverseBlock(variable_[nodes[i]]);
      known = known && IsKnown((*blocks)[i]);
    }
  }
  return known;
}

std::vector<Matrix4d> GroupSolver::Marginals(const std::vector<int>& nodes) {
  std::vector<Matrix4d> marginals(nodes.size(), Matrix4d::Zero());
  const bool has_factor = factor_damping_ == kLeastDamping || Factorise(kLeastDamping);
  // Nearly singular if all loops of a map are switched off.
  if (!has_factor || !InverseBlocks(nodes, &marginals)) {
    Linearise();
    const Matrix4d prior = kUnknownSigmas.cwiseAbs2().cwiseInverse().asDiagonal();
    for (const int variable : variable_) {
      if (variable != kFixed) {
        equations_->Add(edges_.size() + variable, 0, 0, prior);
      }
    }
    factor_damping_ = kNoFactor;
    if (equations_->Factorise()) {
      InverseBlocks(nodes, &marginals);
    }
  }
  return marginals;
}

}  // namespace pangea
