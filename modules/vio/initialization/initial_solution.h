#pragma once

// The steps of a moving start (initialiser.h), each a function of its own.

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
  std::map<int32_t, Eigen::Vector2d> rays;  // by landmark
  std::vector<ImuSample> imu;  // from the previous image to this one; empty in the first
};

// Gyro bias that makes the images' rotations epipolar; nothing when the tracks do not determine it.
std::optional<Eigen::Vector3d> SolveGyroBias(std::span<const StartFrame> frames,
                                             const Rigid3& T_body_cam, const ImuNoise& noise);

// How much later than supposed the images were taken (seconds, on the IMU's clock), from rotations
// alone: what makes them epipolar with the gyro's. `samples` span the frames and a little more.
// Nothing when the rotation rate does not vary enough to tell, or nothing is gained.
std::optional<double> SolveTimeOffset(std::span<const StartFrame> frames, const Rigid3& T_body_cam,
                                      std::span<const ImuSample> samples, const ImuNoise& noise);

// All vectors in the first body frame.
struct LinearStart {
  Eigen::Vector3d v0 = Eigen::Vector3d::Zero();
  Eigen::Vector3d gravity = Eigen::Vector3d::Zero();
  std::vector<Rigid3> T_first_body;            // of each frame
  std::vector<Eigen::Vector3d> v_first_body;   // m/s
  std::map<int32_t, Eigen::Vector3d> p_first;  // points
};
std::optional<LinearStart> SolveLinear(std::span<const StartFrame> frames, const Rigid3& T_body_cam,
                                       const ImuNoise& noise, const Eigen::Vector3d& gyro_bias);

// The same in other units of length.
LinearStart Scaled(LinearStart start, double scale);

// Refined by bundle adjustment; poses are in a gravity-aligned frame with its origin in the last
// body.
struct RefinedStart {
  std::vector<ImuState> states;        // at every frame's stamp, with one pair of biases
  double time_offset_error_s = 0;      // all images were taken this much after their stamps,
  std::vector<double> stamp_errors_s;  // and each one this much more
  double velocity_sigma = 0;           // m/s, of the last one's, in its least certain direction
  double tilt_sigma = 0;               // rad
  double rms_sigma = 0;                // reprojection residual of the inliers, in sigmas
  double inlier_share = 0;
  // At the minimum; a ray whose point is not before the camera counts as an outlier.
  double cost = std::numeric_limits<double>::infinity();
};
// A start is good for nothing when fewer of the rays fit. When fewer are even before the camera in
// the closed-form solution, Refine tells that share and nothing else.
inline constexpr double kMinInlierShare = 0.8;
// What a start does not know, standard deviations.
struct StartSigmas {
  double ray = 0;                // of an observation, on the plane z = 1
  double accel_bias = 0.15;      // m/s^2, about zero
  double time_offset_s = 0.005;  // of the clocks
  double stamp_s = 0;            // of an image's stamp by itself; 0: they do not jitter
};
std::optional<RefinedStart> Refine(std::span<const StartFrame> frames, const Rigid3& T_body_cam,
                                   const ImuNoise& noise, const Eigen::Vector3d& gyro_bias,
                                   const LinearStart& start, const StartSigmas& sigmas);

// The closed form knows no accelerometer bias. Of a body that hardly moves the bias makes it up to
// several times too large or too small, and the refinement then ends in a minimum of its own. So
// this refines from other scales too; the lowest cost counts. `first`: from the start itself.
using RefineFrom = std::function<std::optional<RefinedStart>(const LinearStart&)>;
RefinedStart BestOfScales(const RefineFrom& refine, const LinearStart& start, RefinedStart first);

}  // namespace pangea::vio
