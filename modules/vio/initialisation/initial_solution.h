#pragma once

// The steps of a moving start (initialiser.h).

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "core/imu/imu.h"
#include "core/rigid3.h"
#include "vio/window/window_state.h"

namespace pangea::vio {

// One image of the start-up window.
struct StartFrame {
  int64_t utime = 0;
  std::map<int32_t, Eigen::Vector2d> rays;  // by landmark id, z = 1
  std::vector<ImuSample> imu;  // from the previous image to this one; empty in the first
};

// Gyro bias for which the gyro's rotations satisfy the epipolar constraints; empty if the tracks do
// not determine it.
std::optional<Eigen::Vector3d> SolveGyroBias(std::span<const StartFrame> frames,
                                             const Rigid3& T_body_cam, const ImuNoise& noise);

// How badly the gyro's rotations satisfy the epipolar constraints with that bias: the mean of the
// pairs' residuals, as angles (radians). Empty if there are too few tracks. `every`: one in so many
// pairs is used, for less work.
std::optional<double> GyroCost(std::span<const StartFrame> frames, const Rigid3& T_body_cam,
                               const ImuNoise& noise, size_t every = 1);

// Time by which the images were taken later than their stamps say (seconds, IMU clock), from
// rotations alone: the offset at which the gyro's rotations satisfy the epipolar constraints best.
// `samples` must span the frames and some time around them. Empty if the rotation rate does not
// vary enough, or if an offset explains the images no better.
std::optional<double> SolveTimeOffset(std::span<const StartFrame> frames, const Rigid3& T_body_cam,
                                      std::span<const ImuSample> samples, const ImuNoise& noise);

// All vectors in the first body frame.
struct LinearStart {
  Eigen::Vector3d v0 = Eigen::Vector3d::Zero();
  Eigen::Vector3d gravity = Eigen::Vector3d::Zero();
  std::vector<Rigid3> T_first_body;            // per frame
  std::vector<Eigen::Vector3d> v_first_body;   // m/s
  std::map<int32_t, Eigen::Vector3d> p_first;  // points, by landmark id
};
std::optional<LinearStart> SolveLinear(std::span<const StartFrame> frames, const Rigid3& T_body_cam,
                                       const ImuNoise& noise, const Eigen::Vector3d& gyro_bias);

// Returns `start` with all lengths multiplied by `scale`; gravity is unchanged.
LinearStart Scaled(LinearStart start, double scale);

// The start after bundle adjustment. Poses are in a gravity-aligned frame with its origin at the
// last body.
struct RefinedStart {
  std::vector<ImuState> states;        // at every frame's stamp, with one pair of biases
  double time_offset_error_s = 0;      // all images were taken this long after their stamps,
  std::vector<double> stamp_errors_s;  // and each one this much later still
  double velocity_sigma = 0;           // m/s, of the last frame, in the least certain direction
  double tilt_sigma = 0;               // rad
  double rms_sigma = 0;                // reprojection residual of the inliers, in sigmas
  double inlier_share = 0;
  // At the minimum; a ray whose point is behind the camera counts as an outlier.
  double cost = std::numeric_limits<double>::infinity();
};
// A start with a smaller share of inlier rays is refused. If a smaller share has its point in front
// of the camera in the closed-form solution, Refine sets inlier_share to that share and nothing
// else.
inline constexpr double kMinInlierShare = 0.8;
// Standard deviations of what is uncertain at a start.
struct StartSigmas {
  double ray = 0;                // of an observation, on the plane z = 1
  double accel_bias = 0.15;      // m/s^2, about zero
  double time_offset_s = 0.005;  // of the offset between the clocks
  double stamp_s = 0;            // of one image's stamp; 0: no jitter
};
std::optional<RefinedStart> Refine(std::span<const StartFrame> frames, const Rigid3& T_body_cam,
                                   const ImuNoise& noise, const Eigen::Vector3d& gyro_bias,
                                   const LinearStart& start, const StartSigmas& sigmas);

// The closed form has no accelerometer bias. If the body hardly moves, the bias makes the scale
// several times too large or too small, or even negative.
using RefineFrom = std::function<std::optional<RefinedStart>(const LinearStart&)>;

// Refines the start. With a negative scale all points are behind the cameras: then `start` is
// replaced by its mirror image, and that is refined.
std::optional<RefinedStart> RefineInFront(const RefineFrom& refine, LinearStart* start);

// A start from one gyro bias.
struct MovingStart {
  RefineFrom refine;
  LinearStart linear;
  std::optional<RefinedStart> refined;
};
// The one whose refinement has the lower cost.
std::optional<MovingStart> BetterOf(std::optional<MovingStart> a, std::optional<MovingStart> b);

// At a wrong scale the refinement ends in a local minimum. So this refines from other scales too
// and returns the result with the lowest cost. `first`: the result refined from `start` itself.
RefinedStart BestOfScales(const RefineFrom& refine, const LinearStart& start, RefinedStart first);

}  // namespace pangea::vio
