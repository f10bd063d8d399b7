#include "vio/window/window_solver.h"

#include <Eigen/Cholesky>
#include <optional>
#include <utility>

#include "core/least_squares/levenberg_marquardt.h"
#include "vio/window/nine_columns.h"

namespace pangea::vio {
namespace {

using Eigen::MatrixXd;

constexpr int kMotionSize = kFrameSize - kPoseSize;  // velocity and biases
static_assert(kMotionSize == NineColumns::ColsAtCompileTime);

// The columns of one frame's velocity and biases in the Cholesky factor.
struct MotionColumns {
  int at = 0;  // first row in the window
  Eigen::LLT<Matrix9d> own;
  Matrix9d next = Matrix9d::Zero();  // rows of the next older frame
  NineColumns of_rest;               // rows of the pose and shared part, as far as they are filled
};

struct CholeskyFactor {
  std::vector<MotionColumns> motions;
  std::vector<int> rest;
  MatrixXd of_rest;  // the lower triangle
};

// Returns nothing if H is not positive definite.
std::optional<CholeskyFactor> Factorise(const WindowState& state, const MatrixXd& H) {
  CholeskyFactor factor;
  factor.rest = RowsOfPoses(state);
  factor.of_rest = H(factor.rest, factor.rest);
  // Number of filled rows of the rest
  int met = kSharedSize + state.frames.back().size() - kMotionSize;
  const MotionColumns* last = nullptr;
  factor.motions.reserve(state.frames.size());
  for (int i = state.Newest(); i >= 0 && !state.frames[i].pose_only; --i) {
    const WindowFrame* older = i > 0 ? &state.frames[i - 1] : nullptr;
    met += older ? older->size() - (older->pose_only ? 0 : kMotionSize) : 0;
    MotionColumns& columns = factor.motions.emplace_back();
    columns.at = state.FirstRow(i) + kPoseSize;
    Matrix9d own = H.block<kMotionSize, kMotionSize>(columns.at, columns.at);
    columns.of_rest = H.middleCols<kMotionSize>(columns.at)(
        std::vector<int>(factor.rest.begin(), factor.rest.begin() + met), Eigen::all);
    if (last) {
      own.noalias() -= last->next.lazyProduct(last->next.transpose());
      SubtractProduct(last->of_rest, last->next, &columns.of_rest);
    }
    columns.own.compute(own);
    if (columns.own.info() != Eigen::Success) {
      return std::nullopt;
    }
    SolveOnTheRight(columns.own.matrixLLT(), columns.of_rest);
    if (older && !older->pose_only) {
      columns.next =
          H.block<kMotionSize, kMotionSize>(state.FirstRow(i - 1) + kPoseSize, columns.at);
      columns.own.matrixU().solveInPlace<Eigen::OnTheRight>(columns.next);
    }
    SubtractSquare(columns.of_rest, factor.of_rest);
    last = &columns;
  }
  return FactoriseInPlace(&factor.of_rest) ? std::optional(std::move(factor)) : std::nullopt;
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
  const auto of_rest = factor.of_rest.triangularView<Eigen::Lower>();
  of_rest.solveInPlace(rest);
  of_rest.transpose().solveInPlace(rest);
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
    add(state.FirstRow(i), kPoseSize);
    add(state.FirstRow(i) + kStampError, state.frames[i].has_stamp_error() ? 1 : 0);
  }
  return rows;
}

MatrixXd SolveWindow(const WindowState& state, const MatrixXd& H, const MatrixXd& b) {
  const auto factor = Factorise(state, H);
  return factor ? Solve(*factor, b) : SolveScaled(H, b);
}

}  // namespace pangea::vio
