#pragma once

// Range checks and conversions that the files of this module share.

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "messages/messages.h"

namespace pangea::messages_checks {

// Largest coordinate of a position, metres: no building is larger.
inline constexpr double kMaxDistance = 1e5;
// Largest seq of a keyframe: this would take months of walking.
inline constexpr int32_t kMaxSeq = 10'000'000;

template <typename T>
Parsed<T> Refused(std::string reason) {
  return {std::nullopt, std::move(reason)};
}

inline Eigen::Vector3d ToVector(const vector3_t& v) { return {v.x, v.y, v.z}; }

// Of every time, in microseconds: a time in nanoseconds is beyond it.
inline constexpr int64_t kMaxUtime = int64_t{1} << 60;

inline bool Bounded(const Eigen::Vector3d& v, double limit) {
  return v.allFinite() && v.cwiseAbs().maxCoeff() <= limit;
}

// Parses a row-major covariance. Nothing unless it is finite, bounded, symmetric and, by Cholesky,
// positive definite.
template <int N>
std::optional<Eigen::Matrix<double, N, N>> ToCovariance(const double* values) {
  const Eigen::Matrix<double, N, N> m =
      Eigen::Map<const Eigen::Matrix<double, N, N, Eigen::RowMajor>>(values);
  constexpr double kMaxVariance = 1e12;
  if (!m.allFinite() || m.cwiseAbs().maxCoeff() > kMaxVariance) {
    return std::nullopt;
  }
  const Eigen::Matrix<double, N, N> symmetric = 0.5 * (m + m.transpose());
  if ((m - symmetric).cwiseAbs().maxCoeff() > 1e-6 * m.cwiseAbs().maxCoeff()) {
    return std::nullopt;
  }
  if (symmetric.llt().info() != Eigen::Success) {
    return std::nullopt;
  }
  return symmetric;
}

template <typename Matrix>
void FromMatrix(const Matrix& m, double* values) {
  Eigen::Map<
      Eigen::Matrix<double, Matrix::RowsAtCompileTime, Matrix::ColsAtCompileTime, Eigen::RowMajor>>{
      values} = m;
}

}  // namespace pangea::messages_checks
