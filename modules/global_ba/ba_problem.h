#pragma once

// The visual-inertial bundle adjustment of one group:
//
//   min  sum_seen rho(|r_landmark|^2) + sum_keyframes ((1 - w) |r_inertial|^2 + w |r_edge|^2)
//        + sum_maps |r_bias|^2 + |r_camera|^2 + |r_scale|^2
//
// over every keyframe's pose, velocity and biases, every landmark, and where each map's camera sits
// on its IMU (ba_factors.h): an odometry finds that on its way, so early keyframes were made with a
// poorer estimate than late ones.
//
// An odometry edge was made of the same samples and rays, and of many images more between the
// keyframes: without it the adjustment knows less of a map than its odometry did. How much of their
// errors the two share is not known, so they are weighted as covariance intersection does (Julier
// and Uhlmann, 1997), which holds whatever they share. The edges of a map have their scale's error
// in common, as none of their covariances can say: it is one unknown a map (ScalePriorFactor), with
// the odometry's own sigma where a map is not metric.
//
// Landmarks are eliminated first (Schur), the rest is one sparse Cholesky. Two rounds: with
// Cauchy's loss what does not fit shows and is dropped, with Huber's the rest is estimated.
// Position and yaw of the whole are free: damping leaves them where they began.
//
// What is held stays as it is: then it is the minimum over the rest alone. A world that is at its
// minimum therefore stays there, whatever of it is held.
//
// In pieces of a few iterations, so that whoever runs it may look up in between and drop it. One
// thread, no clock: the same world gives the same bytes.

#include <memory>
#include <optional>
#include <vector>

#include "core/ids.h"
#include "core/imu/imu_factor.h"

namespace pangea {

struct BaEdge {
  Rigid3 T_previous_this;
  Matrix6d covariance = Matrix6d::Identity();
};

struct BaKeyframe {
  KeyframeId id;
  int64_t utime = 0;
  int camera = 0;  // of the world's
  ImuState imu;    // odom is the group's map frame here
  // The IMU and the odometry since keyframe `previous` of the world; none where a map or a piece
  // of it begins.
  int previous = -1;
  std::optional<Preintegration> preintegration;
  std::optional<BaEdge> edge;
  double unknown_scale = 0;  // sigma of its map's scale; 0 for a metric map
  bool held = false;         // stays as it is
};

// What the keyframes of a map have in common.
struct BaCamera {
  Rigid3 T_body_cam;
  double edge_log_scale = 0;  // how much longer the map's edges are than they should be
  bool held = false;          // stays as it is; otherwise edge_log_scale starts at zero
};

struct BaObservation {
  int keyframe = 0;
  int landmark = 0;
  Eigen::Vector2d ray = Eigen::Vector2d::Zero();  // on the camera's plane z = 1
  Eigen::Matrix2d sqrt_info = Eigen::Matrix2d::Identity();
};

// Indices are into its own vectors. A keyframe comes after its `previous`.
struct BaWorld {
  std::vector<BaCamera> cameras;
  std::vector<BaKeyframe> keyframes;
  std::vector<Eigen::Vector3d> landmarks;  // map frame
  std::vector<BaObservation> observations;
};

// Takes out landmarks that fewer than two keyframes see, and what is seen of them.
void DropLonelyLandmarks(BaWorld* world);

struct BaOptions {
  // How biases wander; white noise comes with each preintegration.
  ImuNoise imu;
  // Of a map's first keyframe, about zero.
  double gyro_bias_sigma = 0.05;   // rad/s
  double accel_bias_sigma = 0.15;  // m/s^2
  // Of T_body_cam about the odometry's last estimate.
  double camera_position_sigma = 0.005;  // m
  double camera_rotation_sigma = 0.005;  // rad
  double loss_scale = 2.0;               // sigmas
  double edge_weight = 0.5;              // w above; the IMU factor beside an edge has the rest
  double edge_scale_sigma = 0.01;        // share by which all edges of a map may be too long
  double max_chi2 = 9.2;                 // of an inlier: 99 % of 2 degrees of freedom
  int iterations_a_piece = 4;
  int max_iterations = 10;  // of each of the two rounds
  double function_tolerance = 5e-4;

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("gyro_random_walk", &imu.gyro_random_walk, {1e-9, 1}, "rad/s^2/sqrt(Hz)",
                "of the gyro's bias");
    archive.Add("accel_random_walk", &imu.accel_random_walk, {1e-9, 1}, "m/s^3/sqrt(Hz)",
                "of the accelerometer's bias");
    archive.Add("gyro_bias_sigma", &gyro_bias_sigma, {1e-6, 10}, "rad/s",
                "of a map's first keyframe, about zero");
    archive.Add("accel_bias_sigma", &accel_bias_sigma, {1e-6, 100}, "m/s^2",
                "of a map's first keyframe, about zero");
    archive.Add("camera_position_sigma", &camera_position_sigma, {1e-6, 1}, "m",
                "of the extrinsics about the odometry's last estimate");
    archive.Add("camera_rotation_sigma", &camera_rotation_sigma, {1e-6, 1}, "rad",
                "of the extrinsics about the odometry's last estimate");
    archive.Add("edge_weight", &edge_weight, {0, 1}, "",
                "of an odometry edge; the IMU factor beside it has the rest");
    archive.Add("edge_scale_sigma", &edge_scale_sigma, {1e-6, 1}, "",
                "share by which all edges of a map may be too long");
    archive.Add("loss_scale", &loss_scale, {0.1, 100}, "sigmas", "of the robust loss");
    archive.Add("max_chi2", &max_chi2, {0.1, 1000}, "", "of an inlier, 2 degrees of freedom");
    archive.Add("iterations_a_piece", &iterations_a_piece, {1, 1000}, "",
                "before messages are handled again");
    archive.Add("max_iterations", &max_iterations, {1, 10000}, "", "of each of the two rounds");
    archive.Add("function_tolerance", &function_tolerance, {0, 1}, "",
                "relative decrease of the cost at which a round ends");
  }
};

class BaProblem {
 public:
  BaProblem(BaWorld world, const BaOptions& options);
  ~BaProblem();
  BaProblem(const BaProblem&) = delete;
  BaProblem& operator=(const BaProblem&) = delete;

  // The next piece of work; false when there is none left.
  bool Advance();

  // As it stands.
  const BaWorld& world() const { return world_; }
  // The last solve's, over all residuals; zero before.
  double cost() const { return cost_; }
  int iterations() const { return iterations_; }

 private:
  enum class Round { kFindOutliers, kEstimate, kDone };
  struct Solver;

  void Begin();
  void DropOutliers();
  void ReadBack();

  BaOptions options_;
  BaWorld world_;
  Round round_ = Round::kFindOutliers;
  std::unique_ptr<Solver> solver_;
  double cost_ = 0;
  int iterations_ = 0;  // of this round
};

}  // namespace pangea
