#include "loop_verification/joint_ba/frame_information.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace pangea {

FrameInformation EliminatePoints(const ceres::CRSMatrix& jacobian, int num_frame_columns) {
  const int n = num_frame_columns;
  const auto num_points = static_cast<size_t>((jacobian.num_cols - n) / 3);
  // Of the rows that touch a point, its columns last; at the end those of the rows without one.
  std::vector<Eigen::MatrixXd> JtJ(num_points + 1, Eigen::MatrixXd::Zero(n + 3, n + 3));
  for (int row = 0; row < jacobian.num_rows; ++row) {
    const int begin = jacobian.rows[row], end = jacobian.rows[row + 1];
    size_t point = num_points;
    std::vector<int> columns;
    for (int i = begin; i < end; ++i) {
      const int past_frames = jacobian.cols[i] - n;
      if (past_frames >= 0) {
        point = static_cast<size_t>(past_frames / 3);
      }
      columns.push_back(past_frames < 0 ? jacobian.cols[i] : n + past_frames % 3);
    }
    for (int i = begin; i < end; ++i) {
      for (int j = begin; j < end; ++j) {
        JtJ[point](columns[i - begin], columns[j - begin]) +=
            jacobian.values[i] * jacobian.values[j];
      }
    }
  }
  FrameInformation information{JtJ.back().topLeftCorner(n, n), {}};
  for (size_t point = 0; point < num_points; ++point) {
    const Eigen::MatrixXd W = JtJ[point].topRightCorner(n, 3);
    const Eigen::Matrix3d V = JtJ[point].bottomRightCorner<3, 3>();
    information.of_point.emplace_back(JtJ[point].topLeftCorner(n, n) -
                                      W * V.inverse() * W.transpose());
    information.total += information.of_point.back();
  }
  return information;
}

std::optional<Matrix6d> CovarianceOfFirst(const Eigen::MatrixXd& information) {
  const Eigen::LLT<Eigen::MatrixXd> llt(information);
  if (llt.info() != Eigen::Success) {
    return std::nullopt;
  }
  const Eigen::MatrixXd columns = llt.solve(Eigen::MatrixXd::Identity(information.rows(), 6));
  const Matrix6d covariance = columns.topRows<6>();
  return covariance.allFinite() ? std::make_optional(covariance) : std::nullopt;
}

}  // namespace pangea
