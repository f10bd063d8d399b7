// Poses with blank images: tests when maps begin, and the messages on the agent's bus.

#include "external_odometry/external_odometry_process.h"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "core/testing/test_cameras.h"
#include "messages/encoding.h"
#include "messages/messages.h"
#include "pangea/pose_t.hpp"

namespace pangea {
namespace {

constexpr int64_t kOpened = 1'700'000'000'000'000;
constexpr int64_t kPeriod_us = 100'000;

class ExternalOdometryTest : public testing::Test {
 protected:
  ExternalOdometryTest() {
    bus_.Subscribe("POSE_3",
                   [this](const std::string&, Bytes data) { DecodeMessage(data, &pose_); });
    bus_.Subscribe("KEYFRAME_3", [this](const std::string&, Bytes data) {
      KeyframeMessage message{};
      ASSERT_TRUE(DecodeMessage(data, &message));
      const auto keyframe = Parse(message);
      ASSERT_TRUE(keyframe.value) << keyframe.refused;
      ids_.push_back(keyframe.value->id);
    });
  }

  // An image `dt_us` after the last one.
  void Add(const std::optional<Rigid3>& T_odom_body, int64_t dt_us = kPeriod_us) {
    utime_ += dt_us;
    process_.AddImage(utime_, cv::Mat(480, 752, CV_8U, cv::Scalar(90)), T_odom_body);
    bus_.Drain();
  }
  // At 1 m/s along x.
  void Walk(int images) {
    for (int i = 0; i < images; ++i) {
      x_m_ += 0.1;
      Add(Rigid3{Eigen::Quaterniond::Identity(), {x_m_, 0, 1.5}});
    }
  }
  int64_t Maps() const { return opened_ - kOpened; }

  LocalBus bus_;
  int64_t opened_ = kOpened;
  ExternalOdometryProcess process_{bus_, 3, EurocTestCamera(), [this] { return opened_++; },
                                   kOpened};
  std::vector<KeyframeId> ids_;
  pose_t pose_{};
  int64_t utime_ = 1'000'000;
  double x_m_ = 0;
};

TEST_F(ExternalOdometryTest, AWalkIsOneMapOfNumberedKeyframes) {
  Walk(50);
  EXPECT_EQ(Maps(), 1);
  ASSERT_GE(ids_.size(), 12u);  // one in 0.3 m
  for (size_t i = 0; i < ids_.size(); ++i) {
    EXPECT_EQ(ids_[i], (KeyframeId{{3, kOpened}, static_cast<int32_t>(i)}));
  }
  EXPECT_EQ(pose_.utime, utime_);
  EXPECT_EQ(pose_.state, pose_t::STATE_TRACKING);
  EXPECT_NEAR(pose_.T_odom_body.translation.x, x_m_, 1e-9);
  EXPECT_NEAR(pose_.v_odom_body.x, 1, 1e-6);
}

TEST_F(ExternalOdometryTest, AJumpIsNoMotion) {
  Walk(20);
  x_m_ += 0.5;
  Walk(20);
  EXPECT_EQ(Maps(), 2);
  EXPECT_EQ(ids_.back().map.opened_utime, kOpened + 1);
  Add(Rigid3{YawRotation(1.2), {x_m_ + 0.1, 0, 1.5}});
  EXPECT_EQ(Maps(), 3);
}

TEST_F(ExternalOdometryTest, AQuickStartIsMotion) {
  Walk(10);
  for (int i = 0; i < 10; ++i) {
    x_m_ += 0.1 + 0.02 * i;  // to 3 m/s, at 2 m/s^2
    Add(Rigid3{YawRotation(0.3 * i), {x_m_, 0, 1.5}});
  }
  EXPECT_EQ(Maps(), 1);
}

// As of a car. Without a velocity before it each second pose was a jump, and each image a map.
TEST_F(ExternalOdometryTest, AMapMayBeginInFastMotion) {
  for (int i = 0; i < 20; ++i) {
    x_m_ += 1.5;
    Add(Rigid3{Eigen::Quaterniond::Identity(), {x_m_, 0, 1.5}});
  }
  EXPECT_EQ(Maps(), 1);
  x_m_ += 1;
  Add(Rigid3{Eigen::Quaterniond::Identity(), {x_m_ + 1.5, 0, 1.5}});
  EXPECT_EQ(Maps(), 2);
}

TEST_F(ExternalOdometryTest, ShortlyLostGoesOnLongLostDoesNot) {
  Walk(20);
  Add(std::nullopt);
  EXPECT_EQ(pose_.state, pose_t::STATE_LOST);
  x_m_ += 0.1;
  Walk(20);
  EXPECT_EQ(Maps(), 1);
  for (int i = 0; i < 6; ++i) {
    Add(std::nullopt);
  }
  Walk(20);
  EXPECT_EQ(Maps(), 2);
}

TEST_F(ExternalOdometryTest, ImagesThatAreLeftOutAreNoLoss) {
  Walk(20);
  x_m_ += 1.4;
  Add(Rigid3{Eigen::Quaterniond::Identity(), {x_m_, 0, 1.5}}, 1'400'000);
  Walk(20);
  EXPECT_EQ(Maps(), 1);
}

TEST_F(ExternalOdometryTest, AnImageOfTheSameTimeIsRefused) {
  Walk(50);
  const size_t num_keyframes = ids_.size();
  const pose_t before = pose_;
  Add(Rigid3{Eigen::Quaterniond::Identity(), {x_m_ + 0.05, 0, 1.5}}, 0);
  Add(Rigid3{Eigen::Quaterniond::Identity(), {x_m_ + 0.05, 0, 1.5}}, -kPeriod_us);
  EXPECT_EQ(ids_.size(), num_keyframes);
  EXPECT_EQ(pose_.utime, before.utime);
  utime_ += kPeriod_us;
  Walk(10);
  EXPECT_GT(ids_.size(), num_keyframes);
  EXPECT_NEAR(pose_.v_odom_body.x, 1, 1e-6);
  EXPECT_EQ(Maps(), 1);
}

TEST_F(ExternalOdometryTest, APoseThatIsNotFiniteIsALoss) {
  Walk(50);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  Add(Rigid3{Eigen::Quaterniond::Identity(), {nan, 0, 1.5}});
  EXPECT_EQ(pose_.state, pose_t::STATE_LOST);
  EXPECT_EQ(pose_.T_odom_body.translation.x, 0);
  x_m_ += 0.1;
  Walk(1);
  EXPECT_EQ(pose_.state, pose_t::STATE_TRACKING);
  EXPECT_EQ(Maps(), 1);
}

TEST_F(ExternalOdometryTest, AfterStartAnewTheClockMayStartAgain) {
  Walk(50);
  process_.StartAnew();
  utime_ = 0;
  Walk(10);
  EXPECT_EQ(Maps(), 2);
  EXPECT_EQ(pose_.utime, utime_);
}

TEST_F(ExternalOdometryTest, WhatItShowsFollowsTheCorrection) {
  Walk(20);
  Correction correction;
  correction.map = ids_.back().map;
  correction.group = {1, 5};
  correction.revision = 2;
  correction.T_map_odom = Rigid3{Eigen::Quaterniond::Identity(), {0, 7, 0}};
  correction.covariance *= 1e-4;
  PublishMessage(bus_, "CORRECTION_3", ToMessage(correction));
  bus_.Drain();
  Walk(1);
  EXPECT_EQ(pose_.group_revision, 2);
  EXPECT_NEAR(pose_.T_map_body.translation.y, 7, 1e-6);
  EXPECT_NEAR(pose_.T_odom_body.translation.y, 0, 1e-9);
}

}  // namespace
}  // namespace pangea
