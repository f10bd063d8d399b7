#include "vio/window/estimator.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <vector>

#include "core/median.h"
#include "vio/window/testing/test_nees.h"
#include "vio/window/testing/test_ride.h"

namespace pangea::vio {
namespace {

using Eigen::Vector3d;

// Root mean square position error after the best alignment in position and yaw.
double Ate(const Ride& ride) {
  Vector3d mean_e = Vector3d::Zero(), mean_t = Vector3d::Zero();
  const double n = static_cast<double>(ride.tracked.size());
  for (const Ride::Frame& frame : ride.tracked) {
    mean_e += frame.result.T_odom_body.t / n;
    mean_t += frame.truth.T_odom_body.t / n;
  }
  double sine = 0, cosine = 0;
  for (const Ride::Frame& frame : ride.tracked) {
    const Vector3d e = frame.result.T_odom_body.t - mean_e, t = frame.truth.T_odom_body.t - mean_t;
    cosine += t.x() * e.x() + t.y() * e.y();
    sine += t.x() * e.y() - t.y() * e.x();
  }
  const Eigen::Quaterniond q = YawRotation(std::atan2(sine, cosine));
  double sum = 0;
  for (const Ride::Frame& frame : ride.tracked) {
    sum += (frame.result.T_odom_body.t - mean_e - q * (frame.truth.T_odom_body.t - mean_t))
               .squaredNorm();
  }
  return std::sqrt(sum / n);
}

double TiltError(const ImuState& truth, const FrameResult& result) {
  const Vector3d up_true = truth.T_odom_body.q.conjugate() * Vector3d::UnitZ();
  const Vector3d up = result.T_odom_body.q.conjugate() * Vector3d::UnitZ();
  return std::acos(std::min(1.0, up.dot(up_true)));
}

TEST(Estimator, StartsMoving) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    VioTestWorldOptions options;
    options.seed = seed;
    Ride ride(options);
    ride.Advance(45);
    ASSERT_FALSE(ride.tracked.empty()) << ride.last.reason;
    EXPECT_LE(ride.started_s, 3.0);
    const Ride::Frame& first = ride.tracked.front();
    EXPECT_LT(TiltError(first.truth, first.result), 0.035);
    EXPECT_LT((first.result.gyro_bias - first.truth.gyro_bias).norm(), 0.01);
    EXPECT_LT((first.result.accel_bias - first.truth.accel_bias).norm(), 0.35);
    EXPECT_NEAR(first.result.v_odom_body.norm(), first.truth.v_odom_body.norm(), 0.2);
    // Scale: ratio of the distances since the first frame.
    const Ride::Frame& last = ride.tracked.back();
    const double true_length = (last.truth.T_odom_body.t - first.truth.T_odom_body.t).norm();
    const double length = (last.result.T_odom_body.t - first.result.T_odom_body.t).norm();
    EXPECT_NEAR(length / true_length, 1, 0.05) << "seed " << seed;
  }
}

// The rotation rate changes during the read-out. If the image is taken to be of one time, four of
// five such starts come seconds later or never.
TEST(Estimator, StartsWithARollingShutterInAHandThatShakes) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    VioTestWorldOptions options;
    options.seed = seed;
    options.readout_s = 0.03;
    options.shake_radps2 = 15;
    Ride ride(options);
    ride.Advance(15);
    ASSERT_FALSE(ride.tracked.empty()) << "seed " << seed << ": " << ride.last.reason;
    EXPECT_NEAR(ride.estimator.camera().time_offset_s, ride.world.true_time_offset_s(), 0.001);
  }
}

// At an even 5 m/s with hardly any shaking, scale is almost unknown: a start may be late or
// missing, but must not have a third of the speed.
TEST(Estimator, ADrivesStartIsNotTooSmall) {
  VioTestWorldOptions options;
  options.drive_mps = 5;
  Ride ride(options);
  ride.Advance(22);
  if (!ride.tracked.empty()) {
    EXPECT_NEAR(ride.tracked.front().result.v_odom_body.norm(), 5, 1);
  }
}

// Hardly two images are far enough apart to be window keyframes; the start's result must be kept.
TEST(Estimator, StartsRotatingOnTheSpot) {
  double squares = 0;
  for (uint64_t seed = 1; seed <= 4; ++seed) {
    VioTestWorldOptions options;
    options.seed = seed;
    options.spin_rps = 0.8;
    options.pixel_noise = 0.3;
    Ride ride(options);
    ride.Advance(60);
    ASSERT_FALSE(ride.tracked.empty()) << ride.last.reason;
    const Ride::Frame& first = ride.tracked.front();
    double furthest = 0;
    for (const Ride::Frame& frame : ride.tracked) {
      const Vector3d went = (first.result.T_odom_body.Inverse() * frame.result.T_odom_body).t;
      const Vector3d truth = (first.truth.T_odom_body.Inverse() * frame.truth.T_odom_body).t;
      furthest = std::max(furthest, (went - truth).norm());
    }
    std::cout << "started after " << ride.started_s << " s, at most " << furthest << " m off\n";
    squares += furthest * furthest / 4;
  }
  EXPECT_LT(std::sqrt(squares), 0.055);
}

TEST(Estimator, StartsStationary) {
  VioTestWorldOptions options;
  options.pixel_noise = 0.2;  // a standing image is tracked better than a moving one
  options.stationary_begin_s = -1;
  options.stationary_end_s = 4;
  Ride ride(options);
  ride.Advance(80);
  ASSERT_FALSE(ride.tracked.empty()) << ride.last.reason;
  EXPECT_LE(ride.started_s, 1.5);
  const Ride::Frame& first = ride.tracked.front();
  EXPECT_LT(first.result.v_odom_body.norm(), 0.02);
  EXPECT_LT((first.result.gyro_bias - first.truth.gyro_bias).norm(), 2e-3);
  EXPECT_LT(TiltError(first.truth, first.result), 0.03);
  const Ride::Frame& last = ride.tracked.back();  // after 4 s of motion
  EXPECT_LT(TiltError(last.truth, last.result), 0.01);
  const double true_length = (last.truth.T_odom_body.t - first.truth.T_odom_body.t).norm();
  EXPECT_NEAR((last.result.T_odom_body.t - first.result.T_odom_body.t).norm() / true_length, 1,
              0.05);
}

// Advances the ride without the samples of a gap, as the odometry gets it: each image once a sample
// at its time or later is there.
void AdvanceWithGap(Ride* ride, int frames, int64_t gap_begin_utime, int64_t gap_us) {
  std::vector<VioTestWorld::Input> inputs;
  std::deque<ImuSample> samples;
  for (int i = 0; i < frames; ++i) {
    inputs.push_back(ride->world.Next());
    for (const ImuSample& sample : inputs.back().imu) {
      if (sample.utime <= gap_begin_utime || sample.utime >= gap_begin_utime + gap_us) {
        samples.push_back(sample);
      }
    }
  }
  int64_t fed_utime = 0;
  for (VioTestWorld::Input& input : inputs) {
    input.imu.clear();
    while (fed_utime < input.frame.utime && !samples.empty()) {
      input.imu.push_back(samples.front());
      fed_utime = samples.front().utime;
      samples.pop_front();
    }
    ride->Feed(input);
  }
}

// While samples are missing the hand goes on shaking: the mean of the samples at both ends is a
// guess. If it is trusted, the images are taken for outliers.
TEST(Estimator, AGapInTheSamplesOfAShakenHandCostsLittle) {
  for (uint64_t seed = 1; seed <= 3; ++seed) {
    VioTestWorldOptions options;
    options.seed = seed;
    options.shake_radps2 = 5;
    Ride ride(options);
    const int64_t start_utime = ride.world.Next().frame.utime;
    AdvanceWithGap(&ride, 100, start_utime + 6'000'000, 200'000);
    ASSERT_GT(ride.tracked.size(), 80u) << ride.last.reason;
    const auto at = [&](int64_t utime) {
      return std::ranges::find_if(ride.tracked,
                                  [&](const Ride::Frame& frame) { return frame.utime >= utime; });
    };
    const auto before = at(start_utime + 5'500'000), after = at(start_utime + 9'500'000);
    const Vector3d went = (before->result.T_odom_body.Inverse() * after->result.T_odom_body).t;
    const Vector3d truth = (before->truth.T_odom_body.Inverse() * after->truth.T_odom_body).t;
    EXPECT_LT((went - truth).norm(), 0.12) << "seed " << seed;
  }
}

// A phone's camera starts before its IMU, or the offset between the clocks puts the first images of
// a recording before its first sample. The motion between such images is not known.
TEST(Estimator, StartsWithImagesFromBeforeTheFirstSample) {
  for (const int64_t late_us : {40'000, 450'000}) {
    for (uint64_t seed = 1; seed <= 5; ++seed) {
      VioTestWorldOptions options;
      options.seed = seed;
      Ride ride(options);
      AdvanceWithGap(&ride, 45, 0, 1'000'000 + late_us);
      ASSERT_FALSE(ride.tracked.empty()) << ride.last.reason;
      EXPECT_LE(ride.started_s, 2.5 + 1e-6 * static_cast<double>(late_us));
      const Ride::Frame &first = ride.tracked.front(), &last = ride.tracked.back();
      const double true_length = (last.truth.T_odom_body.t - first.truth.T_odom_body.t).norm();
      const double length = (last.result.T_odom_body.t - first.result.T_odom_body.t).norm();
      EXPECT_LT(TiltError(first.truth, first.result), 0.035);
      EXPECT_NEAR(length / true_length, 1, 0.05) << "seed " << seed;
    }
  }
}

// The offset between the clocks of camera and IMU may be seconds (CameraModel::Invalid).
TEST(Estimator, StartsWithClocksThatDifferBySeconds) {
  Ride ride({});
  VioTestWorld world({});
  CameraModel camera = world.camera();
  camera.time_offset_s = -5;
  EstimatorOptions options;
  options.calibration.distortion = 0.0003;
  Estimator estimator(options, camera, world.options().imu_noise);
  FrameResult last;
  for (int i = 0; i < 45; ++i) {
    ride.Advance(1);
    VioTestWorld::Input input = world.Next();
    input.frame.utime += 5'000'000;
    last = estimator.AddFrame(input.frame, input.imu);
    world.Drop(last.outlier_landmarks);
  }
  ASSERT_EQ(ride.last.state, EstimatorState::kTracking) << ride.last.reason;
  ASSERT_EQ(last.state, EstimatorState::kTracking) << last.reason;
  EXPECT_LT(last.T_odom_body.Minus(ride.last.T_odom_body).norm(), 1e-6);
}

TEST(Estimator, FollowsThePathForHalfAMinute) {
  VioTestWorldOptions options;
  options.seed = 3;
  // The errors of the extrinsics are three times as large as the estimator assumes.
  options.extrinsics_rotation_sigma = 0.003;
  options.extrinsics_position_sigma = 0.003;
  options.time_offset_sigma = 0.002;
  Ride ride(options);
  ride.Advance(300);
  ASSERT_EQ(ride.last.state, EstimatorState::kTracking) << ride.last.reason;
  const double ate = Ate(ride);
  std::cout << "ATE over 30 s: " << ate << " m\n";
  EXPECT_LT(ate, 0.12);
  EXPECT_LT(TiltError(ride.tracked.back().truth, ride.tracked.back().result), 0.01);
  // The calibration has improved.
  const CameraModel camera = ride.estimator.camera();
  EXPECT_NEAR(camera.time_offset_s, ride.world.true_time_offset_s(), 0.001);
  EXPECT_LT(LogSo3(camera.T_body_cam.q * ride.world.true_T_body_cam().q.conjugate()).norm(), 0.004);
}

// Of a ride's last keyframe: the common error of the depths, and the sigma stated for it.
struct ScaleOf {
  double error = 0, sigma = 0;
};
ScaleOf LastScale(uint64_t seed, double drive_mps) {
  VioTestWorldOptions options;
  options.seed = seed;
  options.drive_mps = drive_mps;
  Ride ride(options);
  ride.Advance(150);
  for (auto keyframe = ride.finished.rbegin(); keyframe != ride.finished.rend(); ++keyframe) {
    std::vector<double> ratios;
    for (const LandmarkDepth& depth : keyframe->landmarks) {
      if (const auto truth = ride.world.TrueDepth(depth.landmark_id, keyframe->utime)) {
        ratios.push_back(std::log(depth.inverse_depth * *truth));
      }
    }
    if (keyframe->scale_sigma && ratios.size() >= 8) {
      return {Median(std::move(ratios)), *keyframe->scale_sigma};
    }
  }
  return {0, 1};  // no information is claimed
}

// On a walk the scale is observable, and its stated sigma fits its error. In even motion at any
// speed it is not: then the stated sigma is too small (docs/maths_vio.md), but far larger than on a
// walk.
TEST(Estimator, KnowsHowWellItKnowsTheScale) {
  constexpr int kWalks = 6;
  double squares = 0;
  double largest_sigma = 0;
  for (uint64_t seed = 1; seed <= kWalks; ++seed) {
    const ScaleOf walk = LastScale(seed, 0);
    std::cout << "scale off by " << walk.error << ", said to be " << walk.sigma << "\n";
    squares += std::pow(walk.error / walk.sigma, 2) / kWalks;
    largest_sigma = std::max(largest_sigma, walk.sigma);
  }
  EXPECT_LT(largest_sigma, 0.02);
  EXPECT_LT(squares, 3.7);  // chi-squared of 6: 99.9 % are below 22.5
  EXPECT_GT(squares, 0.06);
  for (uint64_t seed = 1; seed <= 2; ++seed) {
    const ScaleOf drive = LastScale(seed, 1.5);
    std::cout << "driving " << drive.error << ", " << drive.sigma << "\n";
    EXPECT_GT(drive.sigma, 4 * largest_sigma);
  }
}

// Stamps as of images that are stamped on arrival.
TEST(Estimator, AllowsForStampsThatJitter) {
  double exact = 0, jittering = 0;
  for (uint64_t seed = 1; seed <= 6; ++seed) {
    for (const double jitter_s : {0.0, 0.004}) {
      VioTestWorldOptions options;
      options.seed = seed;
      options.stamp_jitter_s = jitter_s;
      Ride ride(options);
      ride.Advance(120);
      ASSERT_EQ(ride.last.state, EstimatorState::kTracking) << ride.last.reason;
      (jitter_s > 0 ? jittering : exact) += Ate(ride) / 6;
    }
  }
  std::cout << "mean ATE: exact stamps " << exact << " m, 4 ms of jitter " << jittering << " m\n";
  EXPECT_LT(jittering, 1.4 * exact);
}

TEST(Estimator, StandsStillWithoutDrift) {
  double squared_distance = 0, squared_speed = 0;
  for (const uint64_t seed : {4, 5}) {
    VioTestWorldOptions options;
    options.seed = seed;
    options.stationary_begin_s = 5;
    options.stationary_end_s = 17;
    Ride ride(options);
    ride.Advance(60);  // t = 6.9: stationary for 1.4 s
    ASSERT_EQ(ride.last.state, EstimatorState::kTracking) << ride.last.reason;
    const Rigid3 before = ride.last.T_odom_body;
    ride.Advance(100);
    ASSERT_EQ(ride.last.state, EstimatorState::kTracking) << ride.last.reason;
    squared_distance += (ride.last.T_odom_body.t - before.t).squaredNorm() / 2;
    squared_speed += ride.last.v_odom_body.squaredNorm() / 2;
    EXPECT_LT(LogSo3(ride.last.T_odom_body.q * before.q.conjugate()).norm(), 0.005);
    // ... and the walk continues as if it had not stopped.
    ride.Advance(50);
    EXPECT_LT(Ate(ride), 0.1);
  }
  std::cout << "in 10 s " << std::sqrt(squared_distance) << " m, then at "
            << std::sqrt(squared_speed) << " m/s\n";
  EXPECT_LT(std::sqrt(squared_distance), 0.05);  // the noise of one image: 0.02
  EXPECT_LT(std::sqrt(squared_speed), 0.02);
}

TEST(Estimator, TheSameInputGivesTheSameOutput) {
  Ride a({}), b({});
  a.Advance(60);
  b.Advance(60);
  EXPECT_EQ(a.last.T_odom_body.t, b.last.T_odom_body.t);
  EXPECT_EQ(a.last.T_odom_body.q.coeffs(), b.last.T_odom_body.q.coeffs());
  EXPECT_EQ(a.finished.size(), b.finished.size());
}

}  // namespace
}  // namespace pangea::vio
