#include "loop_verification/joint_ba/frame_information.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <limits>
#include <type_traits>
#include <utility>

namespace pangea {
namespace {

using Eigen::MatrixXd;

double PositionTrace(const Matrix6d& covariance) {
  return covariance.topLeftCorner<3, 3>().trace();
}

}  // namespace

template <typename Visit>
void InformationShare::ForEachBlock(const MatrixXd& H, const std::vector<int>& columns,
                                    Eigen::Index size, const Visit& visit) {
  // All blocks but the last have six columns, a size known to the compiler.
  const size_t last = columns.size() - 1;
  for (size_t a = 0; a < columns.size(); ++a) {
    for (size_t b = 0; b < columns.size(); ++b) {
      const auto row = static_cast<Eigen::Index>(6 * a), column = static_cast<Eigen::Index>(6 * b);
      if (columns[a] >= size || columns[b] >= size) {
        continue;
      }
      if (a < last && b < last) {
        visit(H.block<6, 6>(row, column), columns[a], columns[b]);
      } else if (a < last) {
        visit(H.block<6, 1>(row, column), columns[a], columns[b]);
      } else if (b < last) {
        visit(H.block<1, 6>(row, column), columns[a], columns[b]);
      } else {
        visit(H.block<1, 1>(row, column), columns[a], columns[b]);
      }
    }
  }
}

void InformationShare::Add(const MatrixXd& H, const std::vector<int>& columns, double factor,
                           MatrixXd* whole) {
  ForEachBlock(H, columns, whole->cols(), [&](const auto& block, int row, int column) {
    using Block = std::decay_t<decltype(block)>;
    if (row >= column) {
      whole->block<Block::RowsAtCompileTime, Block::ColsAtCompileTime>(row, column) +=
          factor * block;
    }
  });
}

double InformationShare::Dot(const MatrixXd& whole) const {
  double sum = 0;
  ForEachBlock(H, columns, whole.cols(), [&](const auto& block, int row, int column) {
    using Block = std::decay_t<decltype(block)>;
    sum += whole.block<Block::RowsAtCompileTime, Block::ColsAtCompileTime>(row, column)
               .cwiseProduct(block)
               .sum();
  });
  return sum;
}

std::optional<Matrix6d> CovarianceOfFirst(const MatrixXd& information) {
  const Eigen::LLT<MatrixXd> llt(information);
  if (llt.info() != Eigen::Success) {
    return std::nullopt;
  }
  const MatrixXd columns = llt.solve(MatrixXd::Identity(information.rows(), 6));
  const Matrix6d covariance = columns.topRows<6>();
  return covariance.allFinite() ? std::make_optional(covariance) : std::nullopt;
}

std::optional<Matrix6d> CovarianceWithoutOne(const MatrixXd& total,
                                             const std::vector<InformationShare>& of_point,
                                             const std::vector<JoinedPoints>& landmarks) {
  const Eigen::LLT<MatrixXd> llt(total);
  const MatrixXd C = llt.solve(MatrixXd::Identity(total.rows(), total.cols()));
  if (llt.info() != Eigen::Success || !C.allFinite()) {
    return std::nullopt;
  }
  // The inverse of total - S is C + C B^T (I - B C B^T)^-1 B C for S = B^T B and C the inverse of
  // total. So without S the trace grows by at least that of C S C, and at most by that over 1 -
  // tr(C S). Landmarks with the largest bound come first, so that the others can soon be skipped.
  const MatrixXd C_position = C.leftCols<3>();
  const MatrixXd C2 = C_position * C_position.transpose();
  std::vector<std::pair<double, size_t>> order;
  for (size_t i = 0; i < landmarks.size(); ++i) {
    double share = 0, growth = 0;
    for (const int point : landmarks[i].points) {
      share += of_point[point].Dot(C);
      growth += of_point[point].Dot(C2);
    }
    const double at_most =
        share < 1 ? growth / (1 - share) : std::numeric_limits<double>::infinity();
    order.emplace_back(-at_most, i);
  }
  std::sort(order.begin(), order.end());
  Matrix6d worst = C.topLeftCorner<6, 6>();
  const double trace = PositionTrace(worst);
  for (const auto& [minus_growth, i] : order) {
    if (trace - minus_growth <= PositionTrace(worst)) {
      break;
    }
    MatrixXd rest = total;
    for (const int point : landmarks[i].points) {
      of_point[point].AddTo(-1, &rest);
    }
    const std::optional<Matrix6d> without = CovarianceOfFirst(rest);
    if (!without) {
      return std::nullopt;
    }
    if (PositionTrace(*without) > PositionTrace(worst)) {
      worst = *without;
    }
  }
  return worst;
}

}  // namespace pangea
