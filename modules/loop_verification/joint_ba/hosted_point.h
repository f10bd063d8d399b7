#pragma once

// The residuals of one point of the joint window bundle adjustment (joint_ba.h), linearised, and
// the point eliminated (Schur complement).
//
// A point is (x, y, inverse depth) in the camera of its host. Its residuals:
//   seen:   r = S (pi(p_target_cam) - ray), under a robust loss;
//   prior:  r = [S (xy - ray); (rho - exp(-kappa) rho_0) / sigma_rho], kappa the log scale of the
//           host's window: that is truly exp(kappa) times as large as its odometry says.
// All that the frames' errors do to the residuals goes through the point's and the camera's place
// in the world, so products of Jacobians are of 3x3 matrices.

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "core/least_squares/robust_loss.h"
#include "core/rigid3.h"

namespace pangea {

// A camera where a state has it. w: the axes of the bundle adjustment.
struct PosedCamera {
  PosedCamera(const Rigid3& T_w_body, const Rigid3& T_body_cam);

  Eigen::Vector3d p_w_body;
  Eigen::Vector3d p_w_cam;
  Eigen::Matrix3d R_w_cam;
};

struct HostedPoint {
  struct Observation {
    int frame = 0;
    Eigen::Vector2d ray = Eigen::Vector2d::Zero();
    Eigen::Matrix2d sqrt_info = Eigen::Matrix2d::Identity();  // times the root of `share`
    double share = 1;                                         // of one measurement
    size_t match = 0;
  };

  int side = 0;  // whose scale
  int host = 0;  // frame
  // What the host's map knows of it.
  Eigen::Vector2d ray = Eigen::Vector2d::Zero();
  Eigen::Matrix2d sqrt_info = Eigen::Matrix2d::Identity();
  double inverse_depth = 0;
  double inverse_depth_sigma = 0;
  std::vector<Observation> seen;  // by others than the host

  // Of one observation, whitened; nothing behind the camera.
  std::optional<Eigen::Vector2d> Residual(const Observation& observation,
                                          const Eigen::Vector3d& point,
                                          const std::vector<PosedCamera>& cameras) const;
  // Of the depth against its prior, sigmas.
  double DepthResidual(const Eigen::Vector3d& point, double kappa) const;
  // Infinite when the point is behind a camera that sees it.
  double Cost(const Eigen::Vector3d& point, const std::vector<PosedCamera>& cameras, double kappa,
              const RobustLoss& loss) const;
};

// What is left of a point's residuals once it is eliminated: 1/2 e^T H e + g^T e, with e the errors
// of the frames' poses that it touches (its host's, then those of its observations, six each) and
// of kappa. A pose moves the point's place in the world by A = [I, -[arm]x] times its error; so H
// is of blocks A^T C A, with C of 3x3.
struct EliminatedPoint {
  struct Pose {
    Eigen::Vector3d arm;  // from the body to the point, in the world
    Eigen::Matrix3d N;    // information of its observations on the point's place
    Eigen::Matrix3d U;    // L^-1 times the point's information that goes with it
    Eigen::Vector3d g;    // before the point is eliminated
  };
  std::vector<Pose> poses;
  Eigen::Vector3d u_scale;
  double h_scale = 0, g_scale = 0;
  Eigen::Matrix3d L;  // V = L L^T, damped: V is of the point itself
  Eigen::Vector3d d;

  // Into the lower triangle of H and into g, where `columns` has each pose and at last kappa; those
  // behind their last are left out.
  void AddTo(const std::vector<int>& columns, Eigen::MatrixXd* H, Eigen::VectorXd* g) const;
  // All of H, one pose after the other.
  Eigen::MatrixXd Information() const;
  // The point's own step for the step of all columns.
  Eigen::Vector3d Step(const std::vector<int>& columns, const Eigen::VectorXd& step) const;

 private:
  // Of H's block of two poses, C.
  Eigen::Matrix3d Coupling(size_t a, size_t b) const;
};

// At a state in which no point is behind a camera that sees it. `damping`: Levenberg-Marquardt's,
// of the point.
void Eliminate(const HostedPoint& hosted, const Eigen::Vector3d& point,
               const std::vector<PosedCamera>& cameras, double kappa, const RobustLoss& loss,
               double damping, EliminatedPoint* eliminated);

}  // namespace pangea
