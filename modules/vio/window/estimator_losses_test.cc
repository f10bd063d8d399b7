// Tests that the estimator continues, or says that it is lost, when images or inertial samples
// fail.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "vio/window/estimator.h"
#include "vio/window/testing/test_ride.h"

namespace pangea::vio {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;

// Simulates a tracker with gyro prediction in the noise of a covered lens: new features everywhere,
// of which a tenth continues by chance, and one far feature that continues for long and creeps.
class CoveredLens {
 public:
  explicit CoveredLens(Ride* ride) : ride_(*ride) {}
  void Advance() {
    VioTestWorld::Input input = ride_.world.Next();
    std::uniform_real_distribution<double> uniform;
    std::erase_if(noise_, [&](const Observation&) { return uniform(rng_) > 0.1; });
    while (noise_.size() < 150) {
      noise_.push_back(At(next_id_++, {20 + uniform(rng_) * (camera_.width - 40),
                                       20 + uniform(rng_) * (camera_.height - 40)}));
    }
    input.frame.observations = noise_;
    const ImuState truth = ride_.world.TruthAt(input.frame.utime);
    const Eigen::Quaterniond q_cam_odom =
        (truth.T_odom_body.q * ride_.world.true_T_body_cam().q).conjugate();
    if (creeping_.isZero()) {
      creeping_ = q_cam_odom.conjugate() * Vector3d::UnitZ();
    }
    creeping_ = ExpSo3({0, 0, 0.005}) * creeping_;
    if (const auto pixel = camera_.Project(q_cam_odom * creeping_);
        pixel && camera_.Contains(*pixel, 5)) {
      input.frame.observations.push_back(At(kCreeping, *pixel));
    }
    ride_.Feed(input);
  }

 private:
  static constexpr int32_t kCreeping = 1'000'000;
  Observation At(int32_t id, const Eigen::Vector2d& pixel) const {
    return {id, pixel.cast<float>(), *camera_.Unproject(pixel), 1.0};
  }

  Ride& ride_;
  CameraModel camera_ = ride_.world.camera();
  std::mt19937_64 rng_{1};
  std::vector<Observation> noise_;
  Vector3d creeping_ = Vector3d::Zero();
  int32_t next_id_ = kCreeping + 1;
};

// Noise contains no information: the pose must be that of a camera without any features.
TEST(Estimator, ACoveredLensIsBridged) {
  for (uint64_t seed = 1; seed <= 3; ++seed) {
    VioTestWorldOptions options;
    options.seed = seed;
    options.imu_noise = {5e-4, 5e-5, 1e-2, 3e-3, 200};  // a phone's
    Ride covered(options), blind(options);
    covered.Advance(60);
    blind.Advance(60);
    ASSERT_EQ(covered.last.state, EstimatorState::kTracking) << covered.last.reason;
    CoveredLens lens(&covered);
    for (int i = 0; i < 30; ++i) {
      lens.Advance();
      VioTestWorld::Input nothing = blind.world.Next();
      nothing.frame.observations.clear();
      blind.Feed(nothing);
    }
    const Vector3d& p = covered.last.T_odom_body.t;
    EXPECT_LT((p - blind.last.T_odom_body.t).norm(), 0.01) << "seed " << seed;
    covered.Advance(20);
    EXPECT_EQ(covered.last.state, EstimatorState::kTracking) << covered.last.reason;
  }
}

TEST(Estimator, ALensCoveredForLongIsALoss) {
  Ride ride({});
  ride.Advance(50);
  CoveredLens lens(&ride);
  int images = 0, keyframes = 0;
  for (; images < 80 && ride.last.state == EstimatorState::kTracking; ++images) {
    lens.Advance();
    keyframes += ride.last.is_keyframe ? 1 : 0;
  }
  EXPECT_LE(keyframes, 1);     // an image of noise is of no use as a keyframe
  EXPECT_NEAR(images, 51, 2);  // 5 s
  EXPECT_THAT(ride.last.reason, HasSubstr("nothing trackable"));
}

// In the images the cabin stands still, but the samples measure how it starts and stops. Without
// the allowance for unmodelled acceleration the pose is 0.4 m to 15 m off.
TEST(Estimator, InALiftThePoseIsThatInTheCabin) {
  for (const bool stands : {true, false}) {
    for (uint64_t seed = 1; seed <= 2; ++seed) {
      VioTestWorldOptions options;
      options.seed = seed;
      options.imu_noise = {5e-4, 5e-5, 1e-2, 3e-3, 200};  // a phone's
      if (stands) {
        options.stationary_begin_s = 6;
        options.stationary_end_s = 30;
      }
      Ride ride(options);
      ride.Advance(80);
      const size_t keyframes_before = ride.finished.size();
      int contradicted = 0;
      for (int i = 0; i < 140; ++i) {
        VioTestWorld::Input input = ride.world.Next();
        const double t = 0.1 * i;
        const double lift_accel = t < 1.5 ? 1.0 : t >= 6 && t < 7.5 ? -1.0 : 0.0;
        const ImuState truth = ride.world.TruthAt(input.taken_utime);
        for (ImuSample& sample : input.imu) {
          sample.accel += truth.T_odom_body.q.conjugate() * Vector3d(0, 0, lift_accel);
        }
        ride.Feed(input);
        contradicted += ride.last.imu_contradicted ? 1 : 0;
        const Rigid3 T = ride.T_odom_truth() * truth.T_odom_body;
        ASSERT_EQ(ride.last.state, EstimatorState::kTracking) << ride.last.reason;
        ASSERT_LT((T.t - ride.last.T_odom_body.t).norm(), i < 139 ? 0.5 : 0.2) << "at " << t;
      }
      EXPECT_GT(contradicted, 0);
      // These samples must not be a measurement for the server either.
      ride.Flush();
      EXPECT_TRUE(std::any_of(ride.finished.begin() + static_cast<long>(keyframes_before),
                              ride.finished.end(), [](const FinishedKeyframe& keyframe) {
                                return keyframe.edge && !keyframe.preintegration;
                              }));
    }
  }
}

TEST(Estimator, AGapInTheImagesIsALoss) {
  Ride ride({});
  ride.Advance(50);
  ASSERT_EQ(ride.last.state, EstimatorState::kTracking);
  VioTestWorld::Input gap;
  for (int i = 0; i < 15; ++i) {  // 1.5 s of images are lost, but not their samples
    const VioTestWorld::Input next = ride.world.Next();
    gap.frame = next.frame;
    gap.imu.insert(gap.imu.end(), next.imu.begin(), next.imu.end());
  }
  const int64_t newest_utime = ride.tracked.back().utime;
  ride.Feed(gap);
  EXPECT_EQ(ride.last.state, EstimatorState::kLost);
  EXPECT_THAT(ride.last.reason, HasSubstr("no images"));
  // The keyframes of the window are as good as before.
  EXPECT_GT(ride.finished.back().utime, newest_utime - 1'000'000);
  ride.Advance(1);  // it stays lost
  EXPECT_EQ(ride.last.state, EstimatorState::kLost);
}

TEST(Estimator, AGapInTheInertialSamplesIsALoss) {
  Ride ride({});
  ride.Advance(50);
  ASSERT_EQ(ride.last.state, EstimatorState::kTracking);
  for (int i = 0; i < 5; ++i) {
    ride.world.Next();
  }
  VioTestWorld::Input late = ride.world.Next();
  ride.Feed(late);
  EXPECT_EQ(ride.last.state, EstimatorState::kLost);
  EXPECT_THAT(ride.last.reason, HasSubstr("inertial samples have a gap"));
}

// After a gap in the images, a tenth of a second without motion says nothing: the gyroscope's mean
// rate would be taken for its bias.
TEST(Estimator, AStationaryStartTakesASecondOfImages) {
  const VioTestWorld world({});
  const double rate_radps = 0.012, focal_px = world.camera().fx;
  Estimator estimator(EstimatorOptions{}, world.camera(), ImuNoise{});
  int64_t next_imu_utime = 0;
  for (const int64_t utime : {0, 1'000'000, 1'100'000, 1'200'000, 1'300'000}) {
    const double t_s = 1e-6 * static_cast<double>(utime);
    TrackedFrame frame{utime, {}};
    for (int32_t id = 0; id < 80; ++id) {
      const Eigen::Vector2d pixel(60 + 50 * (id % 10) - focal_px * rate_radps * t_s,
                                  60 + 50 * (id / 10));
      frame.observations.push_back(
          {id, pixel.cast<float>(), *world.camera().Unproject(pixel), 0.5});
    }
    std::vector<ImuSample> imu;
    for (; imu.empty() || imu.back().utime < utime; next_imu_utime += 5'000) {
      imu.push_back({next_imu_utime, Vector3d(0, 0, rate_radps), Vector3d(0, 0, kGravity)});
    }
    EXPECT_EQ(estimator.AddFrame(frame, imu).state, EstimatorState::kInitialising) << utime;
  }
}

TEST(Estimator, NoInertialSamplesAreALoss) {
  Ride ride({});
  ride.Advance(50);
  VioTestWorld::Input none = ride.world.Next();
  none.imu.clear();
  ride.Feed(none);
  EXPECT_EQ(ride.last.state, EstimatorState::kLost);
  EXPECT_THAT(ride.last.reason, HasSubstr("no inertial samples"));
}

}  // namespace
}  // namespace pangea::vio
