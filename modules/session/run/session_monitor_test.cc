// Tests the progress that a session shows, from messages on real buses.

#include "session/run/session_monitor.h"

#include <gtest/gtest.h>

#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/messages.h"
#include "pangea/have_t.hpp"
#include "pangea/pose_t.hpp"

namespace pangea::session {
namespace {

const MapId kFirstMap{2, 100}, kSecondMap{2, 200};

class SessionMonitorTest : public ::testing::Test {
 protected:
  template <typename Message>
  void Publish(const std::string& channel, const Message& message) {
    agent_bus_.Publish(channel, EncodeMessage(message));
    for (int i = 0; i < 20; ++i) {
      monitor_.Handle(5);
    }
  }
  void PublishPose(const MapId& map, double x) {
    pose_t pose{};
    pose.utime = ++utime_;
    pose.state = pose_t::STATE_TRACKING;
    pose.map = ToMessage(map);
    pose.T_odom_body = ToMessage(Rigid3(Eigen::Quaterniond::Identity(), {x, 0, 0}));
    pose.T_map_body = pose.T_odom_body;
    Publish(channels::Pose(2), pose);
  }
  void PublishCorrection(const MapId& map, int64_t revision, double yaw) {
    Correction correction;
    correction.map = map;
    correction.group = {1, 50};
    correction.revision = revision;
    correction.T_map_odom.q = YawRotation(yaw);
    Publish(channels::Correction(2), ToMessage(correction));
  }
  double drift_m() const { return monitor_.agent(2).drift_m; }

  const Buses buses_ = ChooseBuses({2}, {}, std::nullopt);
  SessionMonitor monitor_{buses_};
  LcmBus agent_bus_{buses_.agents.at(2)};
  int64_t utime_ = 1'400'000'000'000'000;
};

// Maps of the agent that it has left are corrected too.
TEST_F(SessionMonitorTest, TheDriftIsThatOfTheMapTheAgentIsIn) {
  PublishPose(kFirstMap, 10);
  PublishCorrection(kFirstMap, 1, 0.5);
  EXPECT_EQ(drift_m(), 0) << "where it joined its group";
  PublishCorrection(kFirstMap, 2, 0.6);
  EXPECT_NEAR(drift_m(), 1, 0.01);
  PublishPose(kSecondMap, 50);
  EXPECT_EQ(drift_m(), 0);
  PublishCorrection(kFirstMap, 3, 0.7);
  EXPECT_EQ(drift_m(), 0) << "of the other map";
  PublishCorrection(kSecondMap, 3, 0);
  PublishCorrection(kSecondMap, 4, 0.02);
  EXPECT_NEAR(drift_m(), 1, 0.01);
}

TEST_F(SessionMonitorTest, CpuTimeIsThatOfAllStartsOfAProcess) {
  for (const float cpu_s : {1.0f, 4.0f, 0.5f, 2.0f}) {
    status_t status{};
    status.process = "fusion";
    status.cpu_s = cpu_s;
    Publish(channels::Status(status.process), status);
  }
  EXPECT_DOUBLE_EQ(monitor_.CpuSeconds().at("fusion"), 6);
}

// Those that wait in the uplink's spool come later, so only what HAVE lacks at the end is lost.
TEST_F(SessionMonitorTest, KeyframesAreLostThatTheServerNeverAcknowledges) {
  for (int32_t seq = 0; seq < 5; ++seq) {
    KeyframeMessage keyframe{};
    keyframe.id.map = ToMessage(kFirstMap);
    keyframe.id.seq = seq;
    Publish(channels::Keyframe(2), keyframe);
  }
  EXPECT_EQ(monitor_.Unacknowledged(2), 5);
  EXPECT_EQ(monitor_.Unacknowledged(1), 0);
  const auto publish_have = [this](int32_t highest_seq) {
    have_t have{};
    have.num_maps = 1;
    have.maps = {ToMessage(kFirstMap)};
    have.highest_seq = {highest_seq};
    Publish(std::string(channels::kHave), have);
  };
  publish_have(1);
  EXPECT_EQ(monitor_.Unacknowledged(2), 3);
  publish_have(4);
  EXPECT_EQ(monitor_.Unacknowledged(2), 0);
  publish_have(1);  // of an uplink that was started again
  EXPECT_EQ(monitor_.Unacknowledged(2), 0);
  monitor_.ForgetPublished(2);
  EXPECT_EQ(monitor_.Unacknowledged(2), 0);
}

}  // namespace
}  // namespace pangea::session
