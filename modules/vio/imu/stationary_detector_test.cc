#include "vio/imu/stationary_detector.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/testing/test_cameras.h"
#include "core/testing/test_random.h"

namespace pangea::vio {
namespace {

using Eigen::Vector3d;

constexpr int kFrames = 30;
constexpr double kFrameRate_hz = 20;
constexpr double kRate_hz = 200;
constexpr int kSilent = 10;  // frames of the first half second

// A body that rotates and moves evenly, in front of points 3 to 5 m away.
struct Ride {
  double pixel_noise = 0.7;
  double sigma_px = 1;  // of each observation, in units of the detector's
  int landmarks = 100;
  Vector3d omega = Vector3d::Zero();       // of the body, rad/s
  Vector3d v = Vector3d::Zero();           // m/s
  Vector3d seen_omega = Vector3d::Zero();  // added to the gyro's reading
  Vector3d gyro_bias = Vector3d::Zero();   // gyro bias that the estimator assumes
  double accel_sigma = 0.03;               // m/s^2, each axis
  // After the first half second, m/s^2: noise in place of accel_sigma, and an acceleration upwards.
  std::optional<double> late_accel_sigma = {};
  double late_accel = 0;
  StationaryOptions options = {};
};

struct Said {
  int stationary = 0;  // frames after the first half second
  int early = 0;       // before
};

ImuSample SampleAt(const Ride& ride, int i, std::mt19937_64& rng) {
  const double t = i / kRate_hz;
  const Vector3d gravity = ExpSo3(t * ride.omega).conjugate() * Vector3d(0, 0, kGravity);
  const bool late = t > kSilent / kFrameRate_hz;
  const double accel_sigma =
      late ? ride.late_accel_sigma.value_or(ride.accel_sigma) : ride.accel_sigma;
  const Vector3d up(0, 0, late ? ride.late_accel : 0);
  return {std::llround(1e6 * t), ride.omega + ride.seen_omega + RandomVector(rng, 2e-3),
          gravity + up + RandomVector(rng, accel_sigma)};
}

TrackedFrame FrameAt(const Ride& ride, const CameraModel& camera, double t,
                     const std::vector<Vector3d>& points, std::mt19937_64& rng) {
  const Rigid3 T_start_cam =
      Rigid3(ExpSo3(t * ride.omega), t * ride.v) * Rigid3(LookingAhead(), Vector3d::Zero());
  TrackedFrame frame;
  frame.utime = std::llround(1e6 * t);
  for (int id = 0; id < ride.landmarks; ++id) {
    const Eigen::Vector2d pixel = camera.Project(T_start_cam.Inverse() * points[id]).value() +
                                  RandomVector(rng, ride.sigma_px * ride.pixel_noise).head<2>();
    frame.observations.push_back(
        {id, pixel.cast<float>(), camera.Unproject(pixel).value(), ride.sigma_px});
  }
  return frame;
}

// `since_stop`: if given, every frame has this shift.
Said Watch(const Ride& ride,
           const std::optional<TrackHistory::ShiftSigmas>& since_stop = std::nullopt) {
  std::mt19937_64 rng(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const CameraModel camera = PinholeTestCamera(640, 480, 400);
  std::vector<Vector3d> points;
  for (int i = 0; i < ride.landmarks; ++i) {
    points.emplace_back(4 + uniform(rng), 2 * uniform(rng), 1.5 * uniform(rng));
  }
  StationaryDetector detector(camera, ride.pixel_noise * camera.PixelAngle(), ride.options);
  ImuBuffer imu(ImuNoise{});
  Said said;
  int samples = 0;
  for (int i = 0; i < kFrames; ++i) {
    const double t = i / kFrameRate_hz;
    for (; samples <= t * kRate_hz; ++samples) {
      const ImuSample sample = SampleAt(ride, samples, rng);
      imu.Add({&sample, 1});
    }
    const bool stationary =
        detector.AddFrame(FrameAt(ride, camera, t, points, rng), since_stop, imu, ride.gyro_bias);
    (i < kSilent ? said.early : said.stationary) += stationary ? 1 : 0;
  }
  return said;
}

constexpr int kAll = kFrames - kSilent;
constexpr TrackHistory::ShiftSigmas kNoise{1.7, 2.5};

TEST(StationaryDetector, FindsItStationaryWhateverThePixelsNoise) {
  for (const double pixel_noise : {0.1, 0.7, 3.0}) {
    for (const double sigma_px : {1.0, 2.5}) {
      const Said said = Watch({.pixel_noise = pixel_noise, .sigma_px = sigma_px});
      EXPECT_EQ(said.stationary, kAll) << pixel_noise << " px, " << sigma_px << " sigmas";
      EXPECT_EQ(said.early, 0) << "half a second is needed to tell";
    }
  }
}

// Too slow for the gyro alone to distinguish from a bias: 6 pixels in half a second.
TEST(StationaryDetector, ASlowRotationIsNotStationary) {
  for (int axis = 0; axis < 3; ++axis) {
    const Said said = Watch({.omega = 0.03 * Vector3d::Unit(axis)});
    EXPECT_EQ(said.stationary, 0) << "axis " << axis;
  }
}

// Not measurable by an IMU: sideways 5 pixels in half a second; forwards 3 at the image border.
TEST(StationaryDetector, ASlowMotionIsNotStationary) {
  EXPECT_EQ(Watch({.v = {0, 0.1, 0}}).stationary, 0);
  EXPECT_EQ(Watch({.v = {0, 0, -0.1}}).stationary, 0);
  EXPECT_EQ(Watch({.v = {0.3, 0, 0}}).stationary, 0);
}

// The motion is below the noise within half a second, but not since the body stopped.
TEST(StationaryDetector, WhatHasMovedSinceItStoodStillIsNotStationary) {
  const Ride creeping{.v = {0, 0.004, 0}};
  EXPECT_EQ(Watch(creeping).stationary, kAll);
  EXPECT_EQ(Watch(creeping, {{3.0, 4.0}}).stationary, 0);
  const Said standing = Watch({}, kNoise);
  EXPECT_EQ(standing.stationary, kAll);
  EXPECT_EQ(standing.early, kSilent) << "being stationary still is told at once";
}

// The IMU alone is no evidence of motion.
TEST(StationaryDetector, AShakenBodyStaysStationaryWhileHardlyATrackMoves) {
  const Ride shaken{.late_accel_sigma = 0.4};
  EXPECT_EQ(Watch(shaken, kNoise).stationary, kAll);
  constexpr int kUntilShaken = 5;  // frames
  EXPECT_LT(Watch(shaken, {{2.0, 3.5}}).stationary, kUntilShaken) << "a fifth of the tracks moves";
  EXPECT_EQ(Watch(shaken, {{2.3, 3.0}}).stationary, 0) << "half of the tracks move a little";
  const Ride rotating{.seen_omega = {0, 0.08, 0}, .late_accel_sigma = 0.4};
  EXPECT_EQ(Watch(rotating, kNoise).stationary, 0);
  const Ride sets_off{.late_accel_sigma = 0.4, .late_accel = 0.7};
  EXPECT_LT(Watch(sets_off, kNoise).stationary, kUntilShaken);
}

// In a lift the images are stationary, but the IMU is not.
TEST(StationaryDetector, TheImuMustBeQuietToo) {
  const Said rotating = Watch({.seen_omega = {0, 0.08, 0}});
  EXPECT_EQ(rotating.stationary, 0);
  const Said shaken = Watch({.accel_sigma = 0.25});
  EXPECT_EQ(shaken.stationary, 0);
  EXPECT_EQ(Watch({.accel_sigma = 0.25, .options = {.accel_sigma = 0.6}}).stationary, kAll);
}

TEST(StationaryDetector, AKnownGyroBiasIsNoRotation) {
  const Vector3d bias(0.06, -0.05, 0.04);
  EXPECT_EQ(Watch({.seen_omega = bias, .gyro_bias = bias}).stationary, kAll);
  EXPECT_EQ(Watch({.gyro_bias = bias}).stationary, 0);
}

TEST(StationaryDetector, AFewLandmarksTellNothing) {
  EXPECT_EQ(Watch({.landmarks = 14}).stationary, 0);
  EXPECT_GT(Watch({.landmarks = 40}).stationary, kAll / 2);
}

}  // namespace
}  // namespace pangea::vio
