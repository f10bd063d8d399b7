#include "vio/window/landmarks/landmark_factor.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/least_squares/robust_loss.h"

namespace pangea::vio {
namespace {

using Eigen::Matrix;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr int kC = kCalibrationSize;
// In sigmas: a ray with a larger error pulls with constant force.
constexpr double kHuber = 2.0;
// A point behind a camera that saw it costs as much as a ray with an error of this many sigmas, so
// that moving the point there gains nothing.
constexpr double kBehind = 100;

// Rows of a frame's pose errors and of its stamp's error in the window's error vector.
struct FrameColumns {
  int pose = 0;
  int stamp = -1;  // -1: no stamp error
};
FrameColumns ColumnsOf(const WindowState& state, int frame) {
  const int pose = state.FirstRow(frame);
  return {pose, state.frames[frame].has_stamp_error() ? pose + kStampError : -1};
}

// One ray's derivatives: whitened, weighted and transposed, so that their products work on whole
// columns. kRay: number of errors of a frame, which are those of its pose and perhaps of its stamp.
template <int kRay>
struct RayTerms {
  size_t ray = 0;  // index within the landmark's rays
  Vector2d r;
  Matrix<double, kC, 2> Jt_calibration;
  Matrix<double, kRay, 2> Jt_anchor, Jt_frame;
};

// A landmark before it is eliminated. Rows of W are ordered like the columns of
// NormalEquations::Elimination.
template <int kRay>
struct LandmarkTerms {
  double cost = 0;
  size_t anchor = 0;                 // index of the anchor frame's ray
  std::vector<RayTerms<kRay>> rays;  // those with the point in front of the camera
  Matrix3d V = Matrix3d::Zero();     // information of the point
  Vector3d g_point = Vector3d::Zero();
  Matrix<double, Eigen::Dynamic, 3> W;  // cross terms: the other variables (rows) by the point

  static int Row(size_t ray) { return kC + kRay * static_cast<int>(ray); }
};

template <int kRay>
Matrix<double, kRay, 2> FrameJacobian(const Matrix<double, 2, kPoseSize>& J_pose,
                                      const Vector2d& J_stamp, const WindowFrame& frame) {
  Matrix<double, kRay, 2> Jt;
  Jt.template topRows<kPoseSize>() = J_pose.transpose();
  if constexpr (kRay > kPoseSize) {
    Jt.row(kPoseSize) = (frame.has_stamp_error() ? J_stamp : Vector2d::Zero()).transpose();
  }
  return Jt;
}

template <int kRay>
LandmarkTerms<kRay> LineariseLandmark(RowViews& rows, const Landmark& landmark) {
  const WindowState& state = rows.state();
  using Terms = LandmarkTerms<kRay>;
  const size_t m = landmark.rays.size();
  const WindowFrame& anchor_frame = state.frames[landmark.point.anchor];
  Terms out;
  out.W.setZero(Terms::Row(m), 3);
  out.rays.reserve(m);
  for (size_t j = 0; j < m; ++j) {
    out.anchor = landmark.rays[j].frame == landmark.point.anchor ? j : out.anchor;
  }
  const PointInOdom point(rows, landmark.point);
  for (size_t j = 0; j < m; ++j) {
    const FrameRay& seen = landmark.rays[j];
    const auto predicted = PredictRay(rows, point, seen);
    if (!predicted) {
      out.cost +=
          HuberCost(kBehind, kHuber);  // no derivative, as none would tell where to move the point
      continue;
    }
    const Vector2d r = (predicted->ray - seen.ray) / seen.sigma;
    const double e = r.norm();
    const double root = std::sqrt(HuberWeight(e, kHuber)), scale = root / seen.sigma;
    out.cost += HuberCost(e, kHuber);
    RayTerms<kRay>& terms = out.rays.emplace_back();
    terms.ray = j;
    terms.r = root * r;
    terms.Jt_calibration = scale * predicted->J_calibration.transpose();
    const Matrix<double, 2, 3> J_point = scale * predicted->J_point;
    out.V += J_point.transpose() * J_point;
    out.g_point += J_point.transpose() * terms.r;
    out.W.template topRows<kC>() += terms.Jt_calibration * J_point;
    if (j == out.anchor) {
      continue;  // in its anchor frame the ray of a point does not depend on any pose
    }
    terms.Jt_anchor =
        scale * FrameJacobian<kRay>(predicted->J_anchor, predicted->J_anchor_stamp, anchor_frame);
    terms.Jt_frame = scale * FrameJacobian<kRay>(predicted->J_frame, predicted->J_frame_stamp,
                                                 state.frames[seen.frame]);
    out.W.template middleRows<kRay>(Terms::Row(out.anchor)) += terms.Jt_anchor * J_point;
    out.W.template middleRows<kRay>(Terms::Row(j)) += terms.Jt_frame * J_point;
  }
  return out;
}

template <int kRay>
NormalEquations::Elimination Eliminate(const LandmarkTerms<kRay>& terms, double damping) {
  Matrix3d V = terms.V;
  V.diagonal() *= 1 + damping;
  V.diagonal().array() += 1e-9;
  const Matrix3d V_inverse = V.inverse();
  NormalEquations::Elimination elimination;
  elimination.offset = -V_inverse * terms.g_point;
  elimination.gain.noalias() = (-V_inverse).lazyProduct(terms.W.transpose());
  elimination.stamps = kRay > kPoseSize;
  return elimination;
}

// The next functions add a frame's part of the gradient and of the calibration's rows of H, and the
// block of two frames.
template <int kRay>
void AddGradient(const FrameColumns& at, const Matrix<double, kRay, 1>& part, VectorXd* g) {
  g->segment<kPoseSize>(at.pose) += part.template head<kPoseSize>();
  if (kRay > kPoseSize && at.stamp >= 0) {
    (*g)[at.stamp] += part[kRay - 1];
  }
}

template <int kRay>
void AddToCalibration(const FrameColumns& at, const Matrix<double, kC, kRay>& part, MatrixXd* H) {
  H->block<kC, kPoseSize>(0, at.pose) += part.template leftCols<kPoseSize>();
  if (kRay > kPoseSize && at.stamp >= 0) {
    H->block<kC, 1>(0, at.stamp) += part.col(kRay - 1);
  }
}

template <int kRay>
void AddBlock(const FrameColumns& i, const FrameColumns& j, const Matrix<double, kRay, kRay>& part,
              MatrixXd* H) {
  if (i.pose > j.pose) {  // the lower triangle
    AddBlock<kRay>(j, i, part.transpose(), H);
    return;
  }
  H->block<kPoseSize, kPoseSize>(i.pose, j.pose) +=
      part.template topLeftCorner<kPoseSize, kPoseSize>();
  if constexpr (kRay > kPoseSize) {
    if (j.stamp >= 0) {
      H->block<kPoseSize, 1>(i.pose, j.stamp) += part.template topRightCorner<kPoseSize, 1>();
    }
    if (i.stamp >= 0) {
      H->block<1, kPoseSize>(i.stamp, j.pose) += part.template bottomLeftCorner<1, kPoseSize>();
    }
    if (i.stamp >= 0 && j.stamp >= 0) {
      (*H)(i.stamp, j.stamp) += part(kPoseSize, kPoseSize);
    }
  }
}

// Adds the rays' information, with the point fixed.
template <int kRay>
void AddRays(const LandmarkTerms<kRay>& terms, const std::vector<FrameColumns>& columns,
             NormalEquations* out) {
  const FrameColumns& anchor = columns[terms.anchor];
  // Sums for the blocks that all rays share: calibration (c) and anchor (a).
  Matrix<double, kC, kC> H_cc = Matrix<double, kC, kC>::Zero();
  Matrix<double, kC, kRay> H_ca = Matrix<double, kC, kRay>::Zero();
  Matrix<double, kRay, kRay> H_aa = Matrix<double, kRay, kRay>::Zero();
  Matrix<double, kRay, 1> g_a = Matrix<double, kRay, 1>::Zero();
  for (const RayTerms<kRay>& ray : terms.rays) {
    const auto& Jt_c = ray.Jt_calibration;
    H_cc.noalias() += Jt_c.lazyProduct(Jt_c.transpose());
    out->g.head<kC>() += Jt_c * ray.r;
    if (ray.ray == terms.anchor) {
      continue;
    }
    const auto &Jt_a = ray.Jt_anchor, &Jt_f = ray.Jt_frame;
    const FrameColumns& frame = columns[ray.ray];
    H_ca.noalias() += Jt_c.lazyProduct(Jt_a.transpose());
    H_aa.noalias() += Jt_a.lazyProduct(Jt_a.transpose());
    g_a += Jt_a * ray.r;
    AddGradient<kRay>(frame, Jt_f * ray.r, &out->g);
    AddToCalibration<kRay>(frame, Jt_c * Jt_f.transpose(), &out->H);
    AddBlock<kRay>(frame, frame, Jt_f * Jt_f.transpose(), &out->H);
    AddBlock<kRay>(anchor, frame, Jt_a * Jt_f.transpose(), &out->H);
  }
  out->H.topLeftCorner<kC, kC>() += H_cc;
  AddGradient<kRay>(anchor, g_a, &out->g);
  AddToCalibration<kRay>(anchor, H_ca, &out->H);
  AddBlock<kRay>(anchor, anchor, H_aa, &out->H);
}

// Subtracts the information that is lost because the point is unknown: the Schur complement.
template <int kRay>
void AddElimination(const LandmarkTerms<kRay>& terms,
                    const NormalEquations::Elimination& elimination,
                    const std::vector<FrameColumns>& columns, NormalEquations* out) {
  const auto W_c = terms.W.template topRows<kC>();
  out->H.topLeftCorner<kC, kC>() += W_c.lazyProduct(elimination.gain.leftCols<kC>());
  out->g.head<kC>() += W_c * elimination.offset;
  for (size_t j = 0; j < columns.size(); ++j) {
    const auto W_j = terms.W.template middleRows<kRay>(terms.Row(j));
    const Matrix<double, 3, kRay> gain_j = elimination.gain.template middleCols<kRay>(terms.Row(j));
    AddGradient<kRay>(columns[j], W_j * elimination.offset, &out->g);
    AddToCalibration<kRay>(columns[j], W_c * gain_j, &out->H);
    for (size_t i = 0; i <= j; ++i) {
      const auto W_i = terms.W.template middleRows<kRay>(terms.Row(i));
      AddBlock<kRay>(columns[i], columns[j], W_i * gain_j, &out->H);
    }
  }
}

template <int kRay>
void AddLandmark(RowViews& rows, const Landmark& landmark, double damping, NormalEquations* out) {
  const LandmarkTerms<kRay> terms = LineariseLandmark<kRay>(rows, landmark);
  std::vector<FrameColumns> columns;
  columns.reserve(landmark.rays.size());
  for (const FrameRay& seen : landmark.rays) {
    columns.push_back(ColumnsOf(rows.state(), seen.frame));
  }
  out->cost += terms.cost;
  out->eliminations.push_back(Eliminate<kRay>(terms, damping));
  AddRays<kRay>(terms, columns, out);
  AddElimination<kRay>(terms, out->eliminations.back(), columns, out);
}

bool HasStamps(const WindowState& state, const Landmark& landmark) {
  return std::any_of(landmark.rays.begin(), landmark.rays.end(), [&](const FrameRay& seen) {
    return state.frames[seen.frame].has_stamp_error();
  });
}

}  // namespace

void AddLandmark(RowViews& rows, const Landmark& landmark, double damping, NormalEquations* out) {
  HasStamps(rows.state(), landmark) ? AddLandmark<kPoseSize + 1>(rows, landmark, damping, out)
                                    : AddLandmark<kPoseSize>(rows, landmark, damping, out);
}

NormalEquations::Elimination EliminateLandmark(RowViews& rows, const Landmark& landmark) {
  return HasStamps(rows.state(), landmark)
             ? Eliminate<kPoseSize + 1>(LineariseLandmark<kPoseSize + 1>(rows, landmark), 0)
             : Eliminate<kPoseSize>(LineariseLandmark<kPoseSize>(rows, landmark), 0);
}

double LandmarkCost(RowViews& rows, const Landmark& landmark) {
  const Vector3d p_odom = InOdom(rows, landmark.point);
  double cost = 0;
  for (const FrameRay& seen : landmark.rays) {
    const double error = RayError(rows, p_odom, seen);
    cost += HuberCost(std::isfinite(error) ? error : kBehind, kHuber);
  }
  return cost;
}

double RayError(RowViews& rows, const Vector3d& p_odom, const FrameRay& seen) {
  const auto ray = PredictRayOnly(rows, p_odom, seen);
  return ray ? (*ray - seen.ray).norm() / seen.sigma : std::numeric_limits<double>::infinity();
}

}  // namespace pangea::vio
