#include "sim/path/spline_path.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <array>
#include <stdexcept>
#include <vector>

#include "sim/random.h"

namespace pangea::sim {
namespace {

constexpr int kDegree = UniformSpline::kDegree;
using Weights = std::array<double, kDegree + 1>;

// Weights of the kDegree + 1 control points around u in [0, 1] of a segment, for the derivative of
// the given order with respect to u. Cox-de Boor on integer knots; each derivative is a difference
// of the basis of one degree less.
Weights BasisWeights(double u, int order) {
  Weights b{1.0};
  for (int d = 1; d <= kDegree; ++d) {
    Weights next{};
    const bool differentiate = d > kDegree - order;
    for (int j = 0; j <= d; ++j) {
      const double left = j > 0 ? b[static_cast<size_t>(j - 1)] : 0.0;
      const double right = j < d ? b[static_cast<size_t>(j)] : 0.0;
      next[static_cast<size_t>(j)] =
          differentiate ? left - right : ((u + d - j) * left + (j + 1 - u) * right) / d;
    }
    b = next;
  }
  return b;
}

Eigen::VectorXd Seconds(const Trajectory& trajectory) {
  Eigen::VectorXd seconds(static_cast<Eigen::Index>(trajectory.size()));
  for (size_t i = 0; i < trajectory.size(); ++i) {
    seconds[static_cast<Eigen::Index>(i)] =
        1e-6 * static_cast<double>(trajectory[i].utime - trajectory.front().utime);
  }
  return seconds;
}

Eigen::MatrixXd Positions(const Trajectory& trajectory) {
  Eigen::MatrixXd rows(static_cast<Eigen::Index>(trajectory.size()), 3);
  for (size_t i = 0; i < trajectory.size(); ++i) {
    rows.row(static_cast<Eigen::Index>(i)) = trajectory[i].T.t.transpose();
  }
  return rows;
}

// Coefficients x y z w, with the sign that is continuous with the previous row.
Eigen::MatrixXd Quaternions(const Trajectory& trajectory) {
  Eigen::MatrixXd rows(static_cast<Eigen::Index>(trajectory.size()), 4);
  Eigen::Vector4d previous = trajectory.front().T.q.coeffs();
  for (size_t i = 0; i < trajectory.size(); ++i) {
    Eigen::Vector4d q = trajectory[i].T.q.coeffs();
    if (q.dot(previous) < 0) {
      q = -q;
    }
    rows.row(static_cast<Eigen::Index>(i)) = q.transpose();
    previous = q;
  }
  return rows;
}

const Trajectory& AtLeastTwo(const Trajectory& trajectory) {
  if (trajectory.size() < 2) {
    throw std::runtime_error("a path needs at least two poses");
  }
  return trajectory;
}

}  // namespace

UniformSpline::UniformSpline(const Eigen::VectorXd& times_s, const Eigen::MatrixXd& values,
                             double spacing_s)
    : spacing_s_(spacing_s) {
  const int segments =
      std::max(1, static_cast<int>(std::ceil(times_s[times_s.size() - 1] / spacing_s)));
  const int n = segments + kDegree;
  using Triplet = Eigen::Triplet<double>;
  std::vector<Triplet> rows;
  for (Eigen::Index i = 0; i < times_s.size(); ++i) {
    const double x = times_s[i] / spacing_s;
    const int segment = std::min(static_cast<int>(x), segments - 1);
    const Weights w = BasisWeights(x - segment, 0);
    for (int j = 0; j <= kDegree; ++j) {
      rows.emplace_back(static_cast<int>(i), segment + j, w[static_cast<size_t>(j)]);
    }
  }
  constexpr double kPenalty = 1e-2;
  const int first_penalty_row = static_cast<int>(times_s.size());
  for (int i = 0; i + 3 < n; ++i) {
    const double difference[4] = {-1, 3, -3, 1};
    for (int j = 0; j < 4; ++j) {
      rows.emplace_back(first_penalty_row + i, i + j, kPenalty * difference[j]);
    }
  }
  Eigen::SparseMatrix<double> A(first_penalty_row + n - 3, n);
  A.setFromTriplets(rows.begin(), rows.end());
  Eigen::MatrixXd b = Eigen::MatrixXd::Zero(A.rows(), values.cols());
  b.topRows(values.rows()) = values;
  Eigen::SparseMatrix<double> normal = A.transpose() * A;
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(normal);
  control_points_ = solver.solve(A.transpose() * b);
}

Eigen::VectorXd UniformSpline::At(double time_s, int order) const {
  const double x = time_s / spacing_s_;
  const int segments = static_cast<int>(control_points_.rows()) - kDegree;
  const int segment = std::clamp(static_cast<int>(std::floor(x)), 0, segments - 1);
  const Weights w = BasisWeights(x - segment, order);
  Eigen::VectorXd value = Eigen::VectorXd::Zero(control_points_.cols());
  for (int j = 0; j <= kDegree; ++j) {
    value += w[static_cast<size_t>(j)] * control_points_.row(segment + j).transpose();
  }
  return value / std::pow(spacing_s_, order);
}

SplinePath::SplinePath(const Trajectory& trajectory, const SplinePathOptions& options)
    : begin_ns_(AtLeastTwo(trajectory).front().utime * 1000),
      end_ns_(trajectory.back().utime * 1000),
      position_(Seconds(trajectory), Positions(trajectory), options.position_spacing_s),
      rotation_(Seconds(trajectory), Quaternions(trajectory), options.rotation_spacing_s) {}

PathState SplinePath::AtSeconds(double time_s) const {
  PathState state;
  // q = s / |s| rotates with omega_body = 2 vec(conj(s) ds) / |s|^2: the change of |s| is along s
  // and contributes to the real part alone.
  const Eigen::Quaterniond s{Eigen::Vector4d(rotation_.At(time_s, 0))};
  const Eigen::Quaterniond ds{Eigen::Vector4d(rotation_.At(time_s, 1))};
  state.omega_body = 2.0 / s.squaredNorm() * (s.conjugate() * ds).vec();
  state.T_ref_body = Rigid3(s.normalized(), position_.At(time_s, 0));
  state.v_ref_body = position_.At(time_s, 1);
  state.a_ref_body = position_.At(time_s, 2);
  return state;
}

uint64_t SplinePath::Hash() const {
  uint64_t hash = HashBytes(&begin_ns_, sizeof(begin_ns_));
  for (const UniformSpline* spline : {&position_, &rotation_}) {
    const Eigen::MatrixXd& c = spline->control_points();
    hash = HashBytes(c.data(), sizeof(double) * static_cast<size_t>(c.size()), hash);
  }
  return hash;
}

}  // namespace pangea::sim
