#pragma once

// Simulates a hand-held camera with an IMU in a hall with points on its walls: the output of an
// ideal tracker and of the sensors, and the truth.

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <optional>
#include <random>
#include <span>
#include <vector>

#include "core/camera_model.h"
#include "core/imu/imu.h"
#include "vio/front_end/tracks.h"
#include "vio/window/window_state.h"

namespace pangea::vio {

// A running mean, for instance of NEES / dimension, which is 1 for an honest covariance.
struct Mean {
  double sum = 0;
  int count = 0;
  void Add(double value) {
    sum += value;
    ++count;
  }
  void AddNees(const Eigen::VectorXd& e, const Eigen::MatrixXd& covariance) {
    Add(e.dot(covariance.llt().solve(e)) / static_cast<double>(e.size()));
  }
  double value() const { return sum / count; }
};

inline ImuNoise ExactImuIntrinsics() {
  ImuNoise noise;
  noise.gyro_scale_sigma = noise.accel_scale_sigma = noise.axes_sigma = 0;
  return noise;
}

struct VioTestWorldOptions {
  uint64_t seed = 1;
  double frame_rate_hz = 10;
  double pixel_noise = 0.7;
  double outlier_share = 0.03;                // of the tracks; they drift away from their point
  ImuNoise imu_noise = ExactImuIntrinsics();  // EuRoC's white noise and walk
  // If above 0: drives straight ahead through a long hall at this speed, hardly shaken, m/s.
  double drive_mps = 0;
  double spin_rps = 0;  // if above 0: rotates on the spot, rad/s
  // The body is stationary between these times, seconds.
  double stationary_begin_s = -10, stationary_end_s = -10;
  double stamp_jitter_s = 0;  // of the images' stamps
  double readout_s = 0;       // if above 0: rolling shutter, first row first
  double shake_radps2 = 0;    // if above 0: the hand shakes, maximum angular acceleration
  // A crowd or a bus, 2 to 4 m away, has this share of the tracks. It appears at crowd_comes_s,
  // moves from crowd_moves_s on (accelerating with 1 m/s^2 if crowd_sets_off, else at once with
  // crowd_mps), and disappears at crowd_end_s.
  double crowd_share = 0;
  double crowd_mps = 1;
  double crowd_comes_s = 0, crowd_moves_s = 0, crowd_end_s = 0;
  bool crowd_sets_off = true;
  // Sigmas of the errors of the calibration that the estimator gets.
  double extrinsics_rotation_sigma = 0;  // rad
  double extrinsics_position_sigma = 0;  // m
  double time_offset_sigma = 0;          // s
  double focal_sigma = 0;                // relative to the focal length
  double centre_sigma = 0;               // relative to the focal length
  // True first distortion coefficient, which the estimator gets as 0. If it is 0, the estimator
  // knows that there is no distortion.
  double unknown_distortion = 0;
  // Errors of the IMU's scale factors and axes, in multiples of the sigmas in imu_noise.
  double imu_intrinsics_sigmas = 1;
};

class VioTestWorld {
 public:
  explicit VioTestWorld(const VioTestWorldOptions& options);

  struct Input {
    TrackedFrame frame;
    int64_t taken_utime = 0;  // the stamp without its error
    // Since the previous call, up to the first at or after the last row
    std::vector<ImuSample> imu;
  };
  Input Next();
  // Ends these tracks, as a tracker would.
  void Drop(std::span<const int32_t> landmark_ids);

  const VioTestWorldOptions& options() const { return options_; }
  CameraModel camera() const { return camera_; }  // as the estimator gets it
  const CameraModel& true_intrinsics() const { return true_intrinsics_; }
  const Rigid3& true_T_body_cam() const { return true_T_body_cam_; }
  double true_time_offset_s() const { return true_time_offset_s_; }
  // State of the body when a past image was taken.
  ImuState TruthAt(int64_t frame_utime) const;
  // Along the camera's z axis, m; empty for a track that drifts off its point or moves.
  std::optional<double> TrueDepth(int32_t landmark_id, int64_t frame_utime) const;

 private:
  struct Track {
    Eigen::Vector3d point;  // for the crowd: its position before it moved
    bool in_crowd = false;
    bool slides = false;
    Eigen::Vector2d velocity = Eigen::Vector2d::Zero();  // pixels per image
    Eigen::Vector2d slid = Eigen::Vector2d::Zero();
  };
  Rigid3 PoseAt(double t) const;
  Eigen::Vector3d VelocityAt(double t) const;
  ImuSample SampleAt(int64_t utime);
  std::optional<Eigen::Vector2d> SeenFrom(const Rigid3& T_odom_cam,
                                          const Eigen::Vector3d& point) const;
  // The pixel in the image taken at `t`, with the row's own exposure time.
  std::optional<Eigen::Vector2d> Seen(const Eigen::Vector3d& point, double t) const;
  Eigen::Vector3d CrowdMoved(double t) const;
  // Begins, continues and ends the crowd's tracks.
  void ObserveCrowd(double t);
  TrackedFrame Observe(int64_t utime);

  VioTestWorldOptions options_;
  std::mt19937_64 rng_;
  std::mt19937_64 crowd_rng_;  // separate, so that the rest of the world does not change
  CameraModel camera_;
  CameraModel true_intrinsics_;
  Rigid3 true_T_body_cam_;
  double true_time_offset_s_ = 0;
  ImuIntrinsics true_imu_intrinsics_;
  Eigen::Vector3d phase_ = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3d> points_;
  std::map<int32_t, Track> tracks_;  // visible ones
  std::map<int32_t, Track> all_tracks_;
  int32_t next_id_ = 1;
  int64_t next_frame_utime_ = 1'000'000;
  int64_t next_imu_utime_ = 900'000;
  Eigen::Vector3d gyro_bias_ = Eigen::Vector3d::Zero(), accel_bias_ = Eigen::Vector3d::Zero();
  std::map<int64_t, std::pair<Eigen::Vector3d, Eigen::Vector3d>> biases_;  // by IMU time
};

}  // namespace pangea::vio
