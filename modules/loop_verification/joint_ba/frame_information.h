#pragma once

// What a bundle adjustment knows of its frames once the points are eliminated, and how much of it
// each point says: the Schur complement of J^T J, point by point.

#include <ceres/crs_matrix.h>

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "core/rigid3.h"

namespace pangea {

struct FrameInformation {
  Eigen::MatrixXd total;                  // of the frames' columns
  std::vector<Eigen::MatrixXd> of_point;  // its share of `total`, by point
};

// `jacobian`: first the frames' columns, then three for each point; no row touches two points.
FrameInformation EliminatePoints(const ceres::CRSMatrix& jacobian, int num_frame_columns);

// Covariance of the first six columns; nothing when the information does not fix them.
std::optional<Matrix6d> CovarianceOfFirst(const Eigen::MatrixXd& information);

}  // namespace pangea
