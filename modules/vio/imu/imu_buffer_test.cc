#include "vio/imu/imu_buffer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "vio/window/testing/window_test_world.h"

namespace pangea::vio {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;

constexpr int64_t kFirst_us = 1'000'000;

ImuBuffer Filled(int count) {
  ImuBuffer buffer(ImuNoise{});
  buffer.Add(TestSamples(count, kFirst_us, 1));  // 5 ms apart
  return buffer;
}

TEST(ImuBuffer, IntegratesExactlyTheSpan) {
  const ImuBuffer buffer = Filled(100);
  const Vector3d bg(0.01, 0, 0), ba(0, 0.1, 0);
  const Preintegration whole =
      buffer.Integrate(kFirst_us + 12'000, kFirst_us + 93'000, {}, bg, ba).measured;
  EXPECT_NEAR(whole.duration_s, 0.081, 1e-12);
  // Integrated in two parts, the result is the same.
  const Preintegration a =
      buffer.Integrate(kFirst_us + 12'000, kFirst_us + 50'000, {}, bg, ba).measured;
  const Preintegration b =
      buffer.Integrate(kFirst_us + 50'000, kFirst_us + 93'000, {}, bg, ba).measured;
  EXPECT_LT((a.delta_v + a.delta_q * b.delta_v - whole.delta_v).norm(), 1e-9);
  EXPECT_LT(LogSo3((a.delta_q * b.delta_q).conjugate() * whole.delta_q).norm(), 1e-9);
}

// A hand starts to rotate: the rotation rate grows during the read-out.
TEST(ImuBuffer, MotionMeetsTheRotationsOfTheMiddleAndTheEnd) {
  constexpr double kReadout_s = 0.03;
  const Vector3d omega(0.2, -0.4, 0.1), alpha(15, -8, 4), bias(0.01, 0.02, -0.01);
  ImuState state;
  state.gyro_bias = bias;
  state.accel_bias = Vector3d(0.3, -0.2, 0.4);
  state.T_odom_body.q = ExpSo3({0.4, -0.3, 0.2});
  const Vector3d a(1, 2, 0);
  const Vector3d force =
      a + state.T_odom_body.q.conjugate() * Vector3d(0, 0, kGravity) + state.accel_bias;
  ImuBuffer buffer(ImuNoise{});
  std::vector<ImuSample> samples;
  for (int i = 0; i <= 20; ++i) {
    const double s = 0.005 * i;
    samples.push_back({kFirst_us + 5'000 * i, omega + s * alpha + bias, force});
  }
  buffer.Add(samples);
  const BodyMotion motion = buffer.MotionFrom(kFirst_us + 10'000, kReadout_s, {}, state);
  EXPECT_LT((motion.omega - (omega + 0.01 * alpha)).norm(), 1e-3);
  EXPECT_LT((motion.alpha - alpha).norm(), 0.1);
  EXPECT_LT((motion.a - a).norm(), 0.2);  // the specific force rotates with the body
  for (const double share : {0.5, 1.0}) {
    const auto moved = buffer.Integrate(kFirst_us + 10'000,
                                        kFirst_us + 10'000 + std::llround(1e6 * share * kReadout_s),
                                        {}, bias, Vector3d::Zero());
    EXPECT_LT(motion.After(share * kReadout_s).q.angularDistance(moved.measured.delta_q), 1e-9);
  }
}

TEST(ImuBuffer, MotionOfAGlobalShutterIsTheRotationRate) {
  ImuState state;
  state.gyro_bias = Vector3d(0.01, 0.02, -0.01);
  const BodyMotion motion = Filled(100).MotionFrom(kFirst_us + 10'000, 0, {}, state);
  EXPECT_EQ(motion.omega, Filled(100).At(kFirst_us + 10'000).gyro - state.gyro_bias);
  EXPECT_EQ(motion.alpha, Vector3d::Zero());
  EXPECT_EQ(motion.a, Vector3d::Zero());
}

// The estimated time offset may ask for the motion behind the newest sample.
TEST(ImuBuffer, MotionBehindTheNewestSampleIsItsRotationRate) {
  constexpr int64_t kNewest_us = kFirst_us + 99 * 5'000;
  const ImuBuffer buffer = Filled(100);
  for (const int64_t behind_us : {0, 1, 20'000}) {
    const BodyMotion motion = buffer.MotionFrom(kNewest_us + behind_us, 0.02, {}, ImuState{});
    EXPECT_EQ(motion.omega, buffer.At(kNewest_us).gyro) << behind_us;
    EXPECT_EQ(motion.alpha, Vector3d::Zero()) << behind_us;
    EXPECT_EQ(motion.a, Vector3d::Zero()) << behind_us;
  }
}

// Exact, as the axis of the rotation is constant.
TEST(BodyMotion, BegunLaterItIsTheSame) {
  const Vector3d axis(0.6, -0.8, 0);
  const BodyMotion motion{2 * axis, 15 * axis, {0.8, -0.3, 0.5}, {2, 1, -3}};
  constexpr double kBegun_s = 0.1;
  for (const double s : {0.0, 0.05, 0.3}) {
    const Rigid3 at_once = motion.After(kBegun_s + s);
    const Rigid3 later = motion.After(kBegun_s) * motion.From(kBegun_s).After(s);
    EXPECT_LT((later.t - at_once.t).norm(), 1e-12);
    EXPECT_LT(LogSo3(later.q * at_once.q.conjugate()).norm(), 1e-12);
  }
}

TEST(ImuBuffer, TheLastSampleHoldsALittleLonger) {
  const ImuBuffer buffer = Filled(100);
  const int64_t last = kFirst_us + 99 * 5'000;
  const Preintegration span =
      buffer.Integrate(last - 10'000, last + 3'000, {}, Vector3d::Zero(), Vector3d::Zero())
          .measured;
  EXPECT_NEAR(span.duration_s, 0.013, 1e-12);
  EXPECT_EQ(buffer.At(last + 3'000).utime, last);
  EXPECT_EQ(buffer.At(last - 7'000).utime, last - 5'000);
}

TEST(ImuBuffer, NamesWhatIsMissing) {
  ImuBuffer buffer = Filled(100);
  const int64_t last = kFirst_us + 99 * 5'000;
  EXPECT_FALSE(buffer.Gap(kFirst_us, last));
  EXPECT_THAT(buffer.Gap(kFirst_us, last + 200'000).value(), HasSubstr("no inertial samples"));
  EXPECT_THAT(buffer.Gap(last + 1, last + 10'000).value(), HasSubstr("no inertial samples"));
  buffer.Add(TestSamples(100, last + 400'000, 2));
  EXPECT_THAT(buffer.Gap(kFirst_us, last + 500'000).value(), HasSubstr("gap of 0.40 s"));
  EXPECT_FALSE(buffer.Gap(last + 400'000, last + 500'000));
}

TEST(ImuBuffer, ForgetsButForAMarginAndTheNewest) {
  ImuBuffer buffer = Filled(200);
  buffer.Forget(kFirst_us + 500'000);
  const auto all = buffer.Latest(1000);
  EXPECT_LE(all.front().utime, kFirst_us + 450'000);
  EXPECT_GE(all.front().utime, kFirst_us + 440'000);
  buffer.Forget(kFirst_us + 100'000'000);
  EXPECT_EQ(buffer.Latest(1000).size(), 100u);
  EXPECT_EQ(buffer.Latest(20).size(), 20u);
  EXPECT_EQ(buffer.Latest(20).back().utime, kFirst_us + 199 * 5'000);
}

}  // namespace
}  // namespace pangea::vio
