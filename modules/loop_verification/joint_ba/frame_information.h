#pragma once

// The information of a bundle adjustment on its frames after elimination of the points, the share
// of each point, and the covariance without some of the points.

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "core/rigid3.h"

namespace pangea {

// A point's share of the information matrix, in the columns that it affects: blocks of six for
// poses, then one column for a scale. `columns`: first column of each block in the whole matrix;
// blocks beyond its last column belong to the fixed frame and are ignored.
struct InformationShare {
  Eigen::MatrixXd H;
  std::vector<int> columns;

  // Adds factor * H to the lower triangle of `whole`.
  void AddTo(double factor, Eigen::MatrixXd* whole) const { Add(H, columns, factor, whole); }
  static void Add(const Eigen::MatrixXd& H, const std::vector<int>& columns, double factor,
                  Eigen::MatrixXd* whole);
  // Inner product (sum of products of entries) with a symmetric matrix of the whole's size.
  double Dot(const Eigen::MatrixXd& whole) const;

 private:
  // Calls visit(block of H, row, column), with row and column in the whole matrix.
  template <typename Visit>
  static void ForEachBlock(const Eigen::MatrixXd& H, const std::vector<int>& columns,
                           Eigen::Index size, const Visit& visit);
};

// Points that belong to one landmark.
struct JoinedPoints {
  std::vector<int> points;
  bool sure = false;
};

// Covariance of the first six columns, from the lower triangle of the information matrix; empty if
// the information does not determine them.
std::optional<Matrix6d> CovarianceOfFirst(const Eigen::MatrixXd& information);

// The largest covariance of the first six columns (by the trace of the position) that results when
// a single landmark is removed. Empty if without one landmark they are undetermined. `total`:
// information of all points.
std::optional<Matrix6d> CovarianceWithoutOne(const Eigen::MatrixXd& total,
                                             const std::vector<InformationShare>& of_point,
                                             const std::vector<JoinedPoints>& landmarks);

}  // namespace pangea
