#pragma once

// The start-up window as a least-squares problem: rays of points, inertial measurements between
// consecutive frames, one pair of biases for all of them with weak priors. The first frame's
// position and yaw are held.
//
// Points are eliminated one by one (Schur complement). They are plain points of odom, so that a
// change of scale is a straight line: scale is the long valley of a start. What is far away does
// not step straight; so after each step of the frames every point settles where its rays want it
// ("embedded point iterations": Jeong et al., CVPR 2010). A handful of steps does. Errors of frames
// are right-invariant (window_state.h).
//
// The error of the clocks' offset is an unknown and, where stamps jitter, that of each stamp. With
// their sum e the image was taken where the body came to within e of the stamp, (R Exp(e w),
// p + e v). Errors of a frame's pose are those where the image was taken, so that points know
// nothing of stamps; but what steps straight is the pose at the stamp, to which inertial
// measurements hold the frames far more tightly than rays do.

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
  Eigen::Vector3d expected = Eigen::Vector3d::Zero();  // in odom, and how well
  double expected_sigma = 0;                           // m
  std::vector<StartRay> rays;                          // frames in order
};

struct StartStamp {
  Eigen::Vector3d omega_body = Eigen::Vector3d::Zero();  // rad/s, at the stamp
  double error_s = 0;                                    // its own, beside the clocks'
};

struct StartImuFactor {
  Preintegration measured;
  Eigen::Matrix<double, 9, 9> information;  // order (rotation, velocity, position)
};

class StartProblem {
 public:
  Rigid3 T_body_cam;
  double ray_sigma = 0;
  std::vector<ImuState> states;    // at the stamps; all with one pair of biases
  std::vector<StartStamp> stamps;  // of each frame
  double stamp_sigma_s = 0;        // 0: stamps do not jitter, their errors no unknowns
  double time_offset_error_s = 0;  // of all stamps
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

  // The image was taken this much after its stamp.
  double StampError(int frame) const { return time_offset_error_s + stamps[frame].error_s; }
  // Where the body was then.
  Rigid3 ImagePose(int frame) const;

  // A half of the sum of squared residuals, in sigmas (those of rays after Huber, 1964); infinite
  // when a point is behind a camera that saw it.
  double Cost() const;
  // Of every point's rays, in sigmas; or infinite.
  std::vector<double> RayErrors() const;
  // The cost's derivatives by the error, points eliminated; of H only the lower triangle.
  struct Equations {
    double cost = 0;
    Eigen::MatrixXd H;
    Eigen::VectorXd g;
    // Of each point: its step = offset + gain * (step of the poses from `first_frame` on).
    struct Elimination {
      int first_frame = 0;
      Eigen::Vector3d offset;
      Eigen::Matrix<double, 3, Eigen::Dynamic> gain;
    };
    std::vector<Elimination> eliminations;
  };
  // `damping`: Levenberg-Marquardt's, a share of the diagonal.
  Equations Linearise(double damping) const;
  // All of it may move (levenberg_marquardt.h).
  StartProblem Estimate() const { return *this; }
  void SetEstimate(StartProblem estimate) { *this = std::move(estimate); }
  // Moves the frames by `step`, the points with them, and lets those settle.
  void Retract(const Equations& equations, const Eigen::VectorXd& step);
  // False when no step makes it better, though one was promised.
  bool Optimise(int max_iterations);
  // Marginal covariance of the newest frame's (dtheta, dv), dv plain; nothing when something is not
  // determined at all.
  std::optional<Matrix6d> NewestCovariance() const;
};

}  // namespace pangea::vio
