#pragma once

// What a bundle adjustment knows of its frames once the points are eliminated, how much of it each
// point says, and what would be known without some of them.

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "core/rigid3.h"

namespace pangea {

// A point's share of the information in the columns that it touches: blocks of six for poses, the
// last column for a scale. `columns`: where each block begins; those behind the last of the whole
// are held and count for nothing.
struct InformationShare {
  Eigen::MatrixXd H;
  std::vector<int> columns;

  // factor * H into the lower triangle of the whole.
  void AddTo(double factor, Eigen::MatrixXd* whole) const { Add(H, columns, factor, whole); }
  static void Add(const Eigen::MatrixXd& H, const std::vector<int>& columns, double factor,
                  Eigen::MatrixXd* whole);
  // The sum of products of its entries with those of a symmetric matrix of the whole's size.
  double Dot(const Eigen::MatrixXd& whole) const;

 private:
  // visit(block of H, row, column): with rows and columns of the whole.
  template <typename Visit>
  static void ForEachBlock(const Eigen::MatrixXd& H, const std::vector<int>& columns,
                           Eigen::Index size, const Visit& visit);
};

// Points that are one landmark.
struct JoinedPoints {
  std::vector<int> points;
  bool sure = false;
};

// Covariance of the first six columns from the lower triangle of the information; nothing when
// that does not fix them.
std::optional<Matrix6d> CovarianceOfFirst(const Eigen::MatrixXd& information);

// The largest covariance of the first six columns, by the trace of its position, that is left when
// one landmark is not there. Nothing when one is needed to fix them. `total`: with all shares.
std::optional<Matrix6d> CovarianceWithoutOne(const Eigen::MatrixXd& total,
                                             const std::vector<InformationShare>& of_point,
                                             const std::vector<JoinedPoints>& landmarks);

}  // namespace pangea
