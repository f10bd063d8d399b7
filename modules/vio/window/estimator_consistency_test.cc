// Tests whether the covariances of finished keyframes fit their errors.

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "core/imu/preintegration.h"
#include "vio/window/testing/test_nees.h"
#include "vio/window/testing/test_ride.h"
#include "vio/window/window_state.h"

namespace pangea::vio {
namespace {

using Eigen::Vector3d;

// The truth at the finished keyframes, in an odom frame with yaw and origin of the first one's
// estimate.
std::vector<ImuState> TruthOf(const Ride& ride) {
  const FinishedKeyframe& first = ride.finished.front();
  const Rigid3 T_first = ride.world.TruthAt(first.utime).T_odom_body;
  const Eigen::Quaterniond rotation =
      YawRotation(YawOf(first.T_odom_body.q * T_first.q.conjugate()));
  std::vector<ImuState> truths;
  for (const FinishedKeyframe& keyframe : ride.finished) {
    ImuState& truth = truths.emplace_back(ride.world.TruthAt(keyframe.utime));
    truth.T_odom_body = {rotation * truth.T_odom_body.q,
                         rotation * (truth.T_odom_body.t - T_first.t) + first.T_odom_body.t};
    truth.v_odom_body = rotation * truth.v_odom_body;
  }
  return truths;
}

// In the window's error coordinates (window_state.h).
Eigen::Matrix<double, 15, 1> ErrorOf(const FinishedKeyframe& keyframe, const ImuState& truth) {
  const Eigen::Quaterniond rotation = truth.T_odom_body.q * keyframe.T_odom_body.q.conjugate();
  Eigen::Matrix<double, 15, 1> e;
  e << LogSo3(rotation), truth.T_odom_body.t - rotation * keyframe.T_odom_body.t,
      truth.v_odom_body - rotation * keyframe.v_odom_body, truth.gyro_bias - keyframe.gyro_bias,
      truth.accel_bias - keyframe.accel_bias;
  return e;
}

Vector6d EdgeErrorOf(const FinishedKeyframe& keyframe, const ImuState& from, const ImuState& to) {
  return (from.T_odom_body.Inverse() * to.T_odom_body).Minus(keyframe.edge->T_previous_this);
}

// The error of the position itself, p - p^ = xi_p + theta x p^; xi_p is only its part without the
// rotation's error.
struct PositionError {
  Eigen::Vector3d error;
  Eigen::Matrix3d covariance;
};
PositionError PositionErrorOf(const FinishedKeyframe& keyframe, const ImuState& truth) {
  Eigen::Matrix<double, 3, 6> J;
  J << -Hat(keyframe.T_odom_body.t), Eigen::Matrix3d::Identity();
  return {truth.T_odom_body.t - keyframe.T_odom_body.t,
          J * keyframe.covariance.topLeftCorner<6, 6>() * J.transpose()};
}

// Information on a shift along odom's axes and on a rotation about its z axis. Variances of
// position and yaw would not do: the start's position depends on velocity and tilt, on which
// information is gained.
Eigen::Matrix4d UnobservableInformation(const Eigen::Matrix<double, 15, 15>& covariance) {
  Eigen::Matrix<double, 15, 4> N = Eigen::Matrix<double, 15, 4>::Zero();
  N.block<3, 3>(kPosition, 0).setIdentity();
  N(kTheta + 2, 3) = 1;
  return N.transpose() * covariance.llt().solve(N);
}

// NEES of the last keyframe of each ride: rides are independent, keyframes of one ride are not.
struct NeesOfLast {
  NeesOfRides position, yaw, tilt, velocity, gyro_bias, accel_bias, edges;

  void Add(const Ride& ride) {
    const std::vector<ImuState> truth = TruthOf(ride);
    const FinishedKeyframe& last = ride.finished.back();
    const auto& P = last.covariance;
    const auto e = ErrorOf(last, truth.back());
    const PositionError p = PositionErrorOf(last, truth.back());
    position.Add(p.error, p.covariance);
    yaw.Add(e.segment<1>(kTheta + 2), P.block<1, 1>(kTheta + 2, kTheta + 2));
    tilt.Add(e.segment<2>(kTheta), P.block<2, 2>(kTheta, kTheta));
    velocity.Add(e.segment<3>(kVelocity), P.block<3, 3>(kVelocity, kVelocity));
    gyro_bias.Add(e.segment<3>(kGyroBias), P.block<3, 3>(kGyroBias, kGyroBias));
    accel_bias.Add(e.segment<3>(kAccelBias), P.block<3, 3>(kAccelBias, kAccelBias));
    edges.Add(EdgeErrorOf(last, truth[truth.size() - 2], truth.back()), last.edge->covariance);
  }
};

TEST(EstimatorConsistency, KeyframesAreAsGoodAsTheirCovarianceSays) {
  NeesOfLast nees;
  for (const Ride& ride : ShortRides(40, {})) {
    ASSERT_GT(ride.finished.size(), 4u) << "seed " << ride.world.options().seed;
    nees.Add(ride);
  }
  nees.position.ExpectHonest("position");
  nees.yaw.ExpectHonest("yaw");
  nees.tilt.ExpectHonest("tilt");
  nees.velocity.ExpectHonest("velocity");
  nees.gyro_bias.ExpectHonest("gyro bias");
  nees.accel_bias.ExpectHonest("accelerometer bias");
  nees.edges.ExpectHonest("edges");
}

// Position and yaw are not observable: no keyframe may have more information on them than the
// start.
TEST(EstimatorConsistency, PositionAndYawAreNeverBetterKnownThanAtTheStart) {
  for (const Ride& ride : TenRides()) {
    const uint64_t seed = ride.world.options().seed;
    ASSERT_GT(ride.finished.size(), 10u) << "seed " << seed;
    // The first keyframe is the start itself.
    const Eigen::Matrix4d at_start = UnobservableInformation(ride.finished.front().covariance);
    for (size_t k = 0; k < ride.finished.size(); ++k) {
      const Eigen::Matrix4d gained =
          UnobservableInformation(ride.finished[k].covariance) - at_start;
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> of_gained(gained,
                                                                     Eigen::EigenvaluesOnly);
      EXPECT_LT(of_gained.eigenvalues().maxCoeff(), 1e-3 * at_start.diagonal().minCoeff())
          << "seed " << seed << ", keyframe " << k;
    }
  }
}

// Without the states of the intrinsics, NEES / dimension is 5 for the accelerometer's bias, and 2.7
// for tilt and edges.
TEST(EstimatorConsistency, AnImuWithWrongIntrinsicsIsBelievedNoMore) {
  NeesOfLast nees;
  VioTestWorldOptions options;
  options.imu_noise = ImuNoise{};
  for (const Ride& ride : ShortRides(20, options)) {
    ASSERT_GT(ride.finished.size(), 4u) << "seed " << ride.world.options().seed;
    nees.Add(ride);
  }
  nees.tilt.ExpectHonest("tilt with a wrong IMU");
  nees.velocity.ExpectHonest("velocity with a wrong IMU");
  nees.accel_bias.ExpectHonest("accelerometer bias with a wrong IMU");
  nees.edges.ExpectHonest("edges with a wrong IMU");
}

// While a wrong time offset is found, published poses are corrected by many of their sigmas. Edges
// between these poses have a NEES / dimension of 4.9.
TEST(EstimatorConsistency, EdgesDoNotBeginAtPosesThatHaveBeenCorrected) {
  VioTestWorldOptions options;
  options.time_offset_sigma = 0.03;
  Mean edges;
  for (const Ride& ride : ShortRides(20, options)) {
    const std::vector<ImuState> truth = TruthOf(ride);
    for (size_t k = 1; k < ride.finished.size(); ++k) {
      edges.AddNees(EdgeErrorOf(ride.finished[k], truth[k - 1], truth[k]),
                    ride.finished[k].edge->covariance);
    }
  }
  EXPECT_GT(edges.count, 80);
  EXPECT_LT(edges.value(), 4) << "NEES / dimension";
}

// A phone with a rolling shutter in a shaking hand: its rotation rate changes during the read-out.
TEST(EstimatorConsistency, RowsThatAccelerateAreBelievedNoMore) {
  VioTestWorldOptions options;
  options.readout_s = 0.03;
  options.shake_radps2 = 15;
  NeesOfLast nees;
  for (const Ride& ride : ShortRides(20, options)) {
    ASSERT_GT(ride.finished.size(), 4u) << "seed " << ride.world.options().seed;
    nees.Add(ride);
  }
  nees.tilt.ExpectHonest("tilt with rows that accelerate");
  nees.velocity.ExpectHonest("velocity with rows that accelerate");
  nees.edges.ExpectHonest("edges with rows that accelerate");
}

// An uncalibrated phone: an unknown lens, and an IMU whose errors are six times as large as stated.
TEST(EstimatorConsistency, AStartWithARoughCalibrationIsBelievedNoMore) {
  VioTestWorldOptions options;
  options.imu_noise = ImuNoise{};
  options.imu_intrinsics_sigmas = 6;
  options.unknown_distortion = 0.07;
  NeesOfRides tilt;
  for (const Ride& ride : Starts(20, options)) {
    ASSERT_FALSE(ride.finished.empty()) << "seed " << ride.world.options().seed;
    const FinishedKeyframe& first = ride.finished.front();
    const auto e = ErrorOf(first, TruthOf(ride).front());
    tilt.Add(e.segment<2>(kTheta), first.covariance.block<2, 2>(kTheta, kTheta));
  }
  tilt.ExpectHonest("a rough start's tilt");
}

TEST(Estimator, KeyframesAreCompleteConsistentAndHonest) {
  std::vector<double> edges, edge_positions, edge_rotations, tilts, depths;  // the rides' means
  Mean preintegrated;
  for (const Ride& ride : TenRides()) {
    Mean edge, edge_position, edge_rotation, tilt, depth;
    const uint64_t seed = ride.world.options().seed;
    ASSERT_FALSE(ride.tracked.empty()) << "seed " << seed << ": " << ride.last.reason;

    // Every announced keyframe comes once, and in order.
    std::vector<int64_t> announced, came;
    for (const Ride::Frame& frame : ride.tracked) {
      if (frame.result.is_keyframe) {
        announced.push_back(frame.utime);
      }
    }
    for (const FinishedKeyframe& keyframe : ride.finished) {
      came.push_back(keyframe.utime);
    }
    EXPECT_EQ(came, announced) << "seed " << seed;
    ASSERT_GT(ride.finished.size(), 5u);

    const Rigid3 T_odom_truth = ride.T_odom_truth();
    for (size_t k = 0; k < ride.finished.size(); ++k) {
      const FinishedKeyframe& keyframe = ride.finished[k];
      const ImuState truth = ride.world.TruthAt(keyframe.utime);
      const Rigid3 T_true = T_odom_truth * truth.T_odom_body;
      const Vector3d rotation = LogSo3(T_true.q * keyframe.T_odom_body.q.conjugate());
      tilt.AddNees(rotation.head<2>(), keyframe.roll_pitch_covariance);
      for (const LandmarkDepth& landmark : keyframe.landmarks) {
        if (const auto z = ride.world.TrueDepth(landmark.landmark_id, keyframe.utime)) {
          const double e = landmark.inverse_depth - 1 / *z;
          depth.Add(e * e / landmark.inverse_depth_var);
        }
      }
      ASSERT_EQ(keyframe.edge.has_value(), k > 0);
      ASSERT_EQ(keyframe.preintegration.has_value(), k > 0);
      if (k == 0) {
        continue;
      }
      // Chained edges give the published poses but for small corrections.
      const FinishedKeyframe& previous = ride.finished[k - 1];
      const Vector6d correction =
          (previous.T_odom_body * keyframe.edge->T_previous_this).Minus(keyframe.T_odom_body);
      EXPECT_LT(correction.norm(), 0.05);
      const Rigid3 T_true_edge =
          ride.world.TruthAt(previous.utime).T_odom_body.Inverse() * truth.T_odom_body;
      const Vector6d e = T_true_edge.Minus(keyframe.edge->T_previous_this);
      const Matrix6d& C = keyframe.edge->covariance;
      edge.AddNees(e, C);
      edge_position.AddNees(e.head<3>(), C.topLeftCorner<3, 3>());
      edge_rotation.AddNees(e.tail<3>(), C.bottomRightCorner<3, 3>());
      // The inertial measurement of the same span, corrected for the true biases.
      const ImuState before = ride.world.TruthAt(previous.utime);
      const CorrectedDelta delta =
          CorrectForBias(*keyframe.preintegration, before.gyro_bias, before.accel_bias);
      const Eigen::Quaterniond dq = before.T_odom_body.q.conjugate() * truth.T_odom_body.q;
      preintegrated.Add(LogSo3(delta.q.conjugate() * dq).norm());
    }
    edges.push_back(edge.value());
    edge_positions.push_back(edge_position.value());
    edge_rotations.push_back(edge_rotation.value());
    tilts.push_back(tilt.value());
    depths.push_back(depth.value());
  }
  ExpectHonest("edges", edges);
  ExpectHonest("edges' positions", edge_positions);
  ExpectHonest("edges' rotations", edge_rotations);
  ExpectHonest("tilts", tilts);
  ExpectHonest("depths", depths);
  EXPECT_LT(preintegrated.value(), 2e-3);
}

}  // namespace
}  // namespace pangea::vio
