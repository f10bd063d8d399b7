#pragma once

// The start-up window as a least-squares problem: rays of points, inertial measurements between
// consecutive frames, one pair of biases for all of them with weak priors. The first frame's
// position and yaw are fixed.
//
// Points are eliminated one by one (Schur complement). They are Cartesian points in odom, so that a
// change of scale, the least certain direction of a start, is a linear step. Distant points are not
// linear in these coordinates; so after each step of the frames every point is optimised alone
// ("embedded point iterations": Jeong et al., CVPR 2010). A few steps suffice. Errors of frames are
// right-invariant (window_state.h).
//
// The error of the time offset is an unknown and, if stamps jitter, also that of each stamp. If e
// is their sum, the image was taken e after its stamp, at the pose (R Exp(e w), p + e v). Errors of
// a frame's pose are those at the time of the image, so that rays do not depend on stamps; but the
// step is linear in the pose at the stamp, because inertial measurements hold the frames far more
// tightly than rays do.

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "core/imu/preintegration.h"
#include "core/rigid3.h"
#include "vio/window/window_state.h"

namespace pangea::vio {

struct StartRay {
  int frame = 0;
  Eigen::Vector2d ray = Eigen::Vector2d::Zero();
};

struct StartPoint {
  Eigen::Vector3d p_odom = Eigen::Vector3d::Zero();
  Eigen::Vector3d expected = Eigen::Vector3d::Zero();  // prior position, in odom
  double expected_sigma = 0;                           // m
  std::vector<StartRay> rays;                          // in order of frames
};

struct StartStamp {
  Eigen::Vector3d omega_body = Eigen::Vector3d::Zero();  // rad/s, at the stamp
  double error_s = 0;                                    // in addition to that of all stamps
};

struct StartImuFactor {
  Preintegration measured;
  Eigen::Matrix<double, 9, 9> information;  // order (rotation, velocity, position)
};

class StartProblem {
 public:
  Rigid3 T_body_cam;
  double ray_sigma = 0;
  std::vector<ImuState> states;    // at the stamps; all have the same biases
  std::vector<StartStamp> stamps;  // of each frame
  double stamp_sigma_s = 0;        // 0: no jitter; stamp errors are no unknowns
  double time_offset_error_s = 0;  // common to all stamps
  double time_offset_sigma_s = 0.005;
  std::vector<StartImuFactor> imu_factors;  // imu_factors[i]: from frame i to frame i + 1
  std::vector<StartPoint> points;
  Eigen::Vector3d expected_gyro_bias = Eigen::Vector3d::Zero();
  double accel_bias_sigma = 0.15;  // m/s^2, about zero

  // Columns of the error: (gyro bias, accel bias, time offset), then each image's (dtheta, xi_p),
  // then each frame's xi_v, then, where stamps jitter, each stamp's.
  int size() const { return StampColumn(stamps_jitter() ? num_frames() : 0); }
  int num_frames() const { return static_cast<int>(states.size()); }
  bool stamps_jitter() const { return stamp_sigma_s > 0; }
  static constexpr int kTimeOffsetColumn = 6;
  int PoseColumn(int frame) const { return kTimeOffsetColumn + 1 + kPoseSize * frame; }
  int VelocityColumn(int frame) const { return PoseColumn(num_frames()) + 3 * frame; }
  int StampColumn(int frame) const { return VelocityColumn(num_frames()) + frame; }

  // The image was taken this long after its stamp, seconds.
  double StampError(int frame) const { return time_offset_error_s + stamps[frame].error_s; }
  // Pose of the body at that time.
  Rigid3 ImagePose(int frame) const;

  // Half the sum of squared residuals in sigmas (rays with Huber's loss, 1964); infinite if a point
  // is behind a camera that saw it.
  double Cost() const;
  // Error of every ray, point by point, in sigmas; infinite for a point behind the camera.
  std::vector<double> RayErrors() const;
  // Derivatives of the cost with respect to the error, points eliminated; only the lower triangle
  // of H is set.
  struct Equations {
    double cost = 0;
    Eigen::MatrixXd H;
    Eigen::VectorXd g;
    // Step of a point: offset + gain * (step of the poses from `first_frame` on).
    struct Elimination {
      int first_frame = 0;
      Eigen::Vector3d offset;
      Eigen::Matrix<double, 3, Eigen::Dynamic> gain;
    };
    std::vector<Elimination> eliminations;
  };
  // `damping`: of Levenberg-Marquardt, relative to the diagonal.
  Equations Linearise(double damping) const;
  // For levenberg_marquardt.h: the estimate is the whole problem.
  StartProblem Estimate() const { return *this; }
  void SetEstimate(StartProblem estimate) { *this = std::move(estimate); }
  // Applies `step` to the frames and the points, then optimises each point alone.
  void Retract(const Equations& equations, const Eigen::VectorXd& step);
  // False if no step lowers the cost, although the linearisation predicts one.
  bool Optimise(int max_iterations);
  // Marginal covariance of the newest frame's (dtheta, dv), dv a plain difference; empty if the
  // system is singular.
  std::optional<Matrix6d> NewestCovariance() const;
};

}  // namespace pangea::vio
