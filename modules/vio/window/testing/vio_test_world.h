#pragma once

// A hand-held camera with an IMU in a hall with points on its walls: what an ideal tracker and the
// sensors would hand to the estimator, and the truth.

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

// A mean, of NEES by their dimension for instance: then 1 is honest.
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
  double outlier_share = 0.03;                // of the tracks: they slide off their point
  ImuNoise imu_noise = ExactImuIntrinsics();  // EuRoC's white noise and walk
  // Above 0: it drives straight ahead through a long hall, hardly shaken, m/s.
  double drive_mps = 0;
  double spin_rps = 0;  // above 0: it rotates on the spot, rad/s
  // The body stands still in between, seconds.
  double stationary_begin_s = -10, stationary_end_s = -10;
  double stamp_jitter_s = 0;  // of the images' stamps
  double readout_s = 0;     // above 0: the rows are exposed one after another, the first one first
  double shake_radps2 = 0;  // above 0: the hand shakes, with this angular acceleration at most
  // A crowd or a bus, 2 to 4 m away, has this share of the tracks. It comes, sets off with 1 m/s^2
  // or is at its speed at once, and is gone at the end.
  double crowd_share = 0;
  double crowd_mps = 1;
  double crowd_comes_s = 0, crowd_moves_s = 0, crowd_end_s = 0;
  bool crowd_sets_off = true;
  // Errors of the calibration the estimator is given.
  double extrinsics_rotation_sigma = 0;  // rad
  double extrinsics_position_sigma = 0;  // m
  double time_offset_sigma = 0;          // s
  double focal_sigma = 0;                // of the focal length
  double centre_sigma = 0;               // of the focal length
  // The lens's first coefficient, given as 0. Else the estimator knows that the lens has none.
  double unknown_distortion = 0;
  // Errors of the IMU's scale factors and axes, in what the noise says they are.
  double imu_intrinsics_sigmas = 1;
};

class VioTestWorld {
 public:
  explicit VioTestWorld(const VioTestWorldOptions& options);

  struct Input {
    TrackedFrame frame;
    int64_t taken_utime = 0;     // its stamp, had it no error
    std::vector<ImuSample> imu;  // since the previous call, to the first at or after the last row
  };
  Input Next();
  // A tracker drops these.
  void Drop(std::span<const int32_t> landmark_ids);

  const VioTestWorldOptions& options() const { return options_; }
  CameraModel camera() const { return camera_; }  // as the estimator is given it
  const CameraModel& true_intrinsics() const { return true_intrinsics_; }
  const Rigid3& true_T_body_cam() const { return true_T_body_cam_; }
  double true_time_offset_s() const { return true_time_offset_s_; }
  // The body when an image of the past was taken.
  ImuState TruthAt(int64_t frame_utime) const;
  // Along the camera's z axis; nothing for a track that slid off or moves.
  std::optional<double> TrueDepth(int32_t landmark_id, int64_t frame_utime) const;

 private:
  struct Track {
    Eigen::Vector3d point;  // of the crowd: before it moved
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
  // In the image of that time, by the row that meets the point.
  std::optional<Eigen::Vector2d> Seen(const Eigen::Vector3d& point, double t) const;
  Eigen::Vector3d CrowdMoved(double t) const;
  // Its tracks come, go on and end.
  void ObserveCrowd(double t);
  TrackedFrame Observe(int64_t utime);

  VioTestWorldOptions options_;
  std::mt19937_64 rng_;
  std::mt19937_64 crowd_rng_;  // of its own: the world stays as it is
  CameraModel camera_;
  CameraModel true_intrinsics_;
  Rigid3 true_T_body_cam_;
  double true_time_offset_s_ = 0;
  ImuIntrinsics true_imu_intrinsics_;
  Eigen::Vector3d phase_ = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3d> points_;
  std::map<int32_t, Track> tracks_;  // those in sight
  std::map<int32_t, Track> all_tracks_;
  int32_t next_id_ = 1;
  int64_t next_frame_utime_ = 1'000'000;
  int64_t next_imu_utime_ = 900'000;
  Eigen::Vector3d gyro_bias_ = Eigen::Vector3d::Zero(), accel_bias_ = Eigen::Vector3d::Zero();
  std::map<int64_t, std::pair<Eigen::Vector3d, Eigen::Vector3d>> biases_;  // by IMU time
};

}  // namespace pangea::vio
