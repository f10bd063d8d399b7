// Maps that end, and corrections of maps.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <set>

#include "messages/channels.h"
#include "messages/encoding.h"
#include "recording/trajectory.h"
#include "vio/front_end/test_images.h"
#include "vio/vio_process.h"
#include "vio/vio_process_test_world.h"

namespace pangea::vio {
namespace {

TEST_F(VioProcessTest, AppliesTheCorrectionToTheShownPoseAndSaysSo) {
  VioProcess process(bus_, options_, 0);
  process.Open(world_.camera(), ImuNoise{});
  Play(process, 0, 5);
  Correction correction;
  correction.map = {7, kMapUtime};
  correction.group = {2, 5};  // fused into another map: another frame, at once
  correction.revision = 4;
  correction.T_map_odom = {YawRotation(0.5), {3, 2, 1}};
  correction.covariance *= 1e-4;
  PublishMessage(bus_, "CORRECTION_7", ToMessage(correction));
  PublishMessage(bus_, "CORRECTION_7", pose_t{});
  bus_.Drain();
  Play(process, 5, 9);
  process.Flush();
  bus_.Drain();
  const pose_t& pose = poses_.back();
  EXPECT_EQ(pose.group_revision, 4);
  const Rigid3 shown = *Parse(pose.T_map_body).value;
  const Rigid3 expected = correction.T_map_odom * *Parse(pose.T_odom_body).value;
  EXPECT_LT(shown.Minus(expected).norm(), 1e-6);
  EXPECT_EQ(keyframes_.back().group_revision, 4);
  EXPECT_EQ(keyframes_.front().group_revision, 0);
}

TEST_F(VioProcessTest, ALostOdometryOpensANewMap) {
  VioProcess process(bus_, options_, 0);
  process.Open(world_.camera(), ImuNoise{});
  Play(process, 0, 6);
  next_imu_ = 9'000'000;  // three seconds of nothing
  Play(process, 9, 15);
  process.Flush();
  bus_.Drain();
  EXPECT_EQ(keyframes_.front().id.map, (MapId{7, kMapUtime}));
  EXPECT_EQ(keyframes_.back().id.map, (MapId{7, kMapUtime + 1}));
  EXPECT_THAT(process.Totals(),
              ::testing::MatchesRegex(fmt::format(
                  "agent 7: [0-9]+ of [0-9]+ images have a pose; {} keyframes in 2 maps",
                  keyframes_.size())));
  process.NoteLag(2'000'000, 5);
  process.NoteLag(20'000, 0);
  ::testing::internal::CaptureStderr();
  process.Tick(1);
  EXPECT_THAT(::testing::internal::GetCapturedStderr(),
              ::testing::HasSubstr("cannot keep up: lag 2.0 s, 5 images dropped"))
      << "the lag is over";
  EXPECT_THAT(process.Totals(), ::testing::EndsWith("; 5 more images were dropped, as this machine "
                                                    "is too slow for real time"));
  int32_t expected = 0;
  for (const Keyframe& keyframe : keyframes_) {
    if (keyframe.id.map.opened_utime == kMapUtime + 1) {
      EXPECT_EQ(keyframe.id.seq, expected++);
      EXPECT_EQ(keyframe.edge.has_value(), keyframe.id.seq > 0);
    }
  }
  EXPECT_GT(expected, 3);
}

// A correction that comes between the loss and the next image is of the map that ended.
TEST_F(VioProcessTest, ACorrectionOfTheLostMapIsNotOfTheNextOne) {
  VioProcess process(bus_, options_, 0);
  process.Open(world_.camera(), ImuNoise{});
  Play(process, 0, 6);
  next_imu_ = 9'000'000;
  Play(process, 9, 9.1);
  ASSERT_EQ(poses_.back().state, pose_t::STATE_LOST);
  Correction correction;
  correction.map = correction.group = {7, kMapUtime};
  correction.revision = 4;
  correction.covariance *= 1e-4;
  PublishMessage(bus_, "CORRECTION_7", ToMessage(correction));
  bus_.Drain();
  Play(process, 9.1, 15);
  process.Flush();
  bus_.Drain();
  EXPECT_EQ(keyframes_.back().id.map, (MapId{7, kMapUtime + 1}));
  EXPECT_EQ(keyframes_.back().group_revision, 0);
}

// Poses of two odom frames must not have one map's id, nor be in one file.
TEST_F(VioProcessTest, AMapThatIsLostBeforeItsFirstKeyframeEndsToo) {
  options_.out_tum = ::testing::TempDir() + "vio_process_lost_early.tum";
  VioProcess process(bus_, options_, 0);
  process.Open(world_.camera(), ImuNoise{});
  Play(process, 0, 3);
  ASSERT_EQ(poses_.back().state, pose_t::STATE_TRACKING) << poses_.back().reason;
  const cv::Mat image = RandomTexture(752, 480, 11);
  for (int64_t utime = 3'000'000; utime < 3'300'000; utime += kImageStep_us) {  // it is thrown
    std::vector<ImuSample> imu;
    for (; next_imu_ <= utime; next_imu_ += kImuStep_us) {
      imu.push_back({next_imu_, Eigen::Vector3d::Zero(), Eigen::Vector3d(400, 0, 0)});
    }
    process.AddTracks({utime, {}}, image, imu);
  }
  bus_.Drain();
  ASSERT_TRUE(keyframes_.empty());
  const size_t before = poses_.size();
  Play(process, 3.3, 7);
  ASSERT_EQ(poses_.back().state, pose_t::STATE_TRACKING) << poses_.back().reason;
  int64_t lost = 0, of_first = 0;
  for (size_t i = 0; i < poses_.size(); ++i) {
    const bool tracking = poses_[i].state == pose_t::STATE_TRACKING;
    lost += poses_[i].state == pose_t::STATE_LOST ? 1 : 0;
    of_first += tracking && i < before ? 1 : 0;
    if (tracking) {
      EXPECT_EQ(poses_[i].map.opened_utime, kMapUtime + (i < before ? 0 : 1)) << i;
    }
  }
  EXPECT_EQ(lost, 1);
  std::vector<std::string> warnings;
  EXPECT_EQ(static_cast<int64_t>(ReadTum(options_.out_tum, &warnings).size()), of_first);
  EXPECT_FALSE(ReadTum(options_.out_tum + ".2", &warnings).empty());
}

}  // namespace
}  // namespace pangea::vio
