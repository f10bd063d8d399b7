#include "vio/keyframes/keyframe_finisher.h"

#include <gtest/gtest.h>

#include "vio/window/testing/window_test_world.h"

namespace pangea::vio {
namespace {

using Eigen::MatrixXd;

// The time offset has changed since the frame was added: its image was taken later than assumed.
TEST(FinishKeyframe, IsWhereTheBodyWasAtTheImage) {
  constexpr int kFrame = 2;
  constexpr double kLate_s = 0.01;
  const WindowState state = TestWindow({.late_s = kLate_s}).state;
  const int size = state.size();
  const MatrixXd P = 1e-6 * MatrixXd::Identity(size, size);
  const FinishedKeyframe keyframe = FinishKeyframe(state, P, TrackHistory{}, kFrame);
  const WindowFrame& frame = state.frames[kFrame];
  const BodyMotion motion{frame.omega_body, frame.alpha_body,
                          frame.imu.T_odom_body.q.conjugate() * frame.imu.v_odom_body,
                          frame.a_body};
  const Rigid3 moved = frame.imu.T_odom_body * motion.After(kLate_s);
  EXPECT_GT((keyframe.T_odom_body.t - frame.imu.T_odom_body.t).norm(), 0.001);
  EXPECT_LT((keyframe.T_odom_body.t - moved.t).norm(), 1e-9);
  EXPECT_LT(keyframe.T_odom_body.q.angularDistance(moved.q), 1e-9);
  // The motion after the image is the body's motion at that time.
  constexpr double kOn_s = 0.02;
  const Rigid3 at_once = frame.imu.T_odom_body * motion.After(kLate_s + kOn_s);
  const Rigid3 later = keyframe.T_odom_body * keyframe.motion.After(kOn_s);
  EXPECT_LT((later.t - at_once.t).norm(), 1e-6);
  EXPECT_LT(later.q.angularDistance(at_once.q), 1e-4);
}

// The window has rotation first, a keyframe translation.
TEST(FinishKeyframe, TellsTheExtrinsicsCovarianceTranslationFirst) {
  const WindowState state = TestWindow({}).state;
  const int size = state.size();
  MatrixXd P = 1e-6 * MatrixXd::Identity(size, size);
  constexpr int kRotationX = kExtrinsics, kTranslationY = kExtrinsics + 4;
  P(kRotationX, kRotationX) = 2e-6;
  P(kTranslationY, kTranslationY) = 5e-6;
  P(kRotationX, kTranslationY) = P(kTranslationY, kRotationX) = 3e-7;
  Matrix6d expected = 1e-6 * Matrix6d::Identity();
  expected(3, 3) = 2e-6;
  expected(1, 1) = 5e-6;
  expected(1, 3) = expected(3, 1) = 3e-7;
  EXPECT_EQ(FinishKeyframe(state, P, TrackHistory{}, 2).T_body_cam_covariance, expected);
}

}  // namespace
}  // namespace pangea::vio
