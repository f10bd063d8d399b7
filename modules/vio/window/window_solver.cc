#include "vio/window/window_solver.h"

#include <Eigen/Cholesky>
#include <optional>
#include <utility>

#include "core/least_squares/levenberg_marquardt.h"

namespace pangea::vio {
namespace {

using Eigen::MatrixXd;

constexpr int kMotionSize = kFrameSize - kPoseSize;  // velocity and biases
using MotionMatrix = Eigen::Matrix<double, kMotionSize, kMotionSize>;

// The columns of one frame's velocity and biases in the Cholesky factor.
struct MotionColumns {
  int at = 0;  // first row in the window
  Eigen::LLT<MotionMatrix> own;
  MotionMatrix next = MotionMatrix::Zero();                    // the next older frame's rows
  Eigen::Matrix<double, Eigen::Dynamic, kMotionSize> of_rest;  // as many rows of it as are met
};

struct CholeskyFactor {
  std::vector<MotionColumns> motions;
  std::vector<int> rest;
  Eigen::LLT<MatrixXd> of_rest;
};

// Nothing when H is not positive definite.
std::optional<CholeskyFactor> Factorise(const WindowState& state, const MatrixXd& H) {
  CholeskyFactor factor;
  factor.rest = RowsOfPoses(state);
  MatrixXd rest = H(factor.rest, factor.rest);
  int met = kSharedSize + state.frames.back().size() - kMotionSize;  // rows of the rest
  const MotionColumns* last = nullptr;
  factor.motions.reserve(state.frames.size());
  for (int i = state.Newest(); i >= 0 && !state.frames[i].pose_only; --i) {
    const WindowFrame* older = i > 0 ? &state.frames[i - 1] : nullptr;
    met += older ? older->size() - (older->pose_only ? 0 : kMotionSize) : 0;
    MotionColumns& columns = factor.motions.emplace_back();
    columns.at = state.Offset(i) + kPoseSize;
    MotionMatrix own = H.block<kMotionSize, kMotionSize>(columns.at, columns.at);
    columns.of_rest = H.middleCols<kMotionSize>(columns.at)(
        std::vector<int>(factor.rest.begin(), factor.rest.begin() + met), Eigen::all);
    if (last) {
      own.noalias() -= last->next * last->next.transpose();
      columns.of_rest.topRows(last->of_rest.rows()).noalias() -=
          last->of_rest * last->next.transpose();
    }
    columns.own.compute(own);
    if (columns.own.info() != Eigen::Success) {
      return std::nullopt;
    }
    const auto upper = columns.own.matrixU();
    upper.solveInPlace<Eigen::OnTheRight>(columns.of_rest);
    if (older && !older->pose_only) {
      columns.next = H.block<kMotionSize, kMotionSize>(state.Offset(i - 1) + kPoseSize, columns.at);
      upper.solveInPlace<Eigen::OnTheRight>(columns.next);
    }
    for (int c = 0; c < met; ++c) {  // the lower triangle
      rest.col(c).segment(c, met - c).noalias() -=
          columns.of_rest.middleRows(c, met - c).lazyProduct(columns.of_rest.row(c).transpose());
    }
    last = &columns;
  }
  factor.of_rest.compute(rest);
  return factor.of_rest.info() == Eigen::Success ? std::optional(std::move(factor)) : std::nullopt;
}

MatrixXd Solve(const CholeskyFactor& factor, const MatrixXd& b) {
  const size_t n = factor.motions.size();
  MatrixXd x = b;
  MatrixXd rest = b(factor.rest, Eigen::all);
  for (size_t i = 0; i < n; ++i) {
    const MotionColumns& columns = factor.motions[i];
    auto own = x.middleRows<kMotionSize>(columns.at);
    columns.own.matrixL().solveInPlace(own);
    rest.topRows(columns.of_rest.rows()).noalias() -= columns.of_rest * own;
    if (i + 1 < n) {
      x.middleRows<kMotionSize>(factor.motions[i + 1].at).noalias() -= columns.next * own;
    }
  }
  factor.of_rest.solveInPlace(rest);
  for (size_t i = n; i-- > 0;) {
    const MotionColumns& columns = factor.motions[i];
    auto own = x.middleRows<kMotionSize>(columns.at);
    own.noalias() -= columns.of_rest.transpose() * rest.topRows(columns.of_rest.rows());
    if (i + 1 < n) {
      own.noalias() -=
          columns.next.transpose() * x.middleRows<kMotionSize>(factor.motions[i + 1].at);
    }
    columns.own.matrixU().solveInPlace(own);
  }
  x(factor.rest, Eigen::all) = rest;
  return x;
}

}  // namespace

std::vector<int> RowsOfPoses(const WindowState& state) {
  std::vector<int> rows;
  const auto add = [&rows](int at, int size) {
    for (int k = 0; k < size; ++k) {
      rows.push_back(at + k);
    }
  };
  add(0, kSharedSize);
  for (int i = state.Newest(); i >= 0; --i) {
    add(state.Offset(i), kPoseSize);
    add(state.Offset(i) + kStampError, state.frames[i].has_stamp_error() ? 1 : 0);
  }
  return rows;
}

MatrixXd SolveWindow(const WindowState& state, const MatrixXd& H, const MatrixXd& b) {
  const auto factor = Factorise(state, H);
  return factor ? Solve(*factor, b) : SolveScaled(H, b);
}

}  // namespace pangea::vio
