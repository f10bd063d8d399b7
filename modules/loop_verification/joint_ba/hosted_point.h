#pragma once

// The residuals of one point of the joint window bundle adjustment (joint_ba.h), linearised, and
// the point eliminated (Schur complement).
//
// A point is (x, y, inverse depth) in the camera of its host. Its residuals:
//   seen:   r = S (pi(p_target_cam) - ray), under a robust loss;
//   prior:  r = [S (xy - ray); (rho - exp(-kappa) rho_0) / sigma_rho], kappa the log scale of the
//           host's window: it is exp(kappa) times as large as in its odometry.
// The errors of the frames act on the residuals only through the positions of point and camera in
// w, so products of Jacobians need only 3x3 matrices.

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "core/least_squares/robust_loss.h"
#include "core/rigid3.h"

namespace pangea {

// Pose of a camera in a state. w: the frame of the bundle adjustment.
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
    Eigen::Matrix2d sqrt_info = Eigen::Matrix2d::Identity();  // multiplied by `share`
    double share = 1;                                         // root of its part of one measurement
    size_t match = 0;
  };

  int side = 0;  // side (m or c) whose scale it has
  int host = 0;  // frame
  // The host's measurement, and the prior of the depth from its map.
  Eigen::Vector2d ray = Eigen::Vector2d::Zero();
  Eigen::Matrix2d sqrt_info = Eigen::Matrix2d::Identity();
  double inverse_depth = 0;
  double inverse_depth_sigma = 0;
  std::vector<Observation> seen;  // by frames other than the host

  // Whitened residual of one observation; empty behind the camera.
  std::optional<Eigen::Vector2d> Residual(const Observation& observation,
                                          const Eigen::Vector3d& point,
                                          const std::vector<PosedCamera>& cameras) const;
  // Residual of the depth's prior, in sigmas.
  double DepthResidual(const Eigen::Vector3d& point, double kappa) const;
  double PriorCost(const Eigen::Vector3d& point, double depth_residual) const;
  // Infinite if the point is behind a camera that sees it.
  double Cost(const Eigen::Vector3d& point, const std::vector<PosedCamera>& cameras, double kappa,
              const RobustLoss& loss) const;
};

// The cost of a point's residuals after its elimination: 1/2 e^T H e + g^T e, with e the errors of
// the poses involved (the host's, then those of its observations, six each) and of kappa. The error
// of a pose displaces the point in w by A = [I, -[arm]x] times the error; so H consists of blocks
// A^T C A with 3x3 matrices C.
struct EliminatedPoint {
  struct Pose {
    Eigen::Vector3d arm;  // from the body to the point, in w
    Eigen::Matrix3d N;    // information of its observations on the point's position
    Eigen::Matrix3d U;    // L^-1 times the cross information with the point
    Eigen::Vector3d g;    // gradient before elimination of the point
  };
  std::vector<Pose> poses;
  double cost = 0;  // of all residuals, as HostedPoint::Cost has it
  Eigen::Vector3d u_scale;
  double h_scale = 0, g_scale = 0;
  Eigen::Matrix3d L;  // V = L L^T; V: the point's own damped information
  Eigen::Vector3d d;

  // Adds to the lower triangle of H and to g. `columns`: first column of each pose, then that of
  // kappa; columns beyond the last one of H are left out.
  void AddTo(const std::vector<int>& columns, Eigen::MatrixXd* H, Eigen::VectorXd* g) const;
  // The full H, one pose after the other.
  Eigen::MatrixXd Information() const;
  // The point's step that belongs to the step of all columns.
  Eigen::Vector3d Step(const std::vector<int>& columns, const Eigen::VectorXd& step) const;

 private:
  // C of H's block for poses a and b.
  Eigen::Matrix3d Coupling(size_t a, size_t b) const;
};

// Requires that the point is behind no camera that sees it. `damping`: Levenberg-Marquardt damping
// of the point.
void Eliminate(const HostedPoint& hosted, const Eigen::Vector3d& point,
               const std::vector<PosedCamera>& cameras, double kappa, const RobustLoss& loss,
               double damping, EliminatedPoint* eliminated);

}  // namespace pangea
