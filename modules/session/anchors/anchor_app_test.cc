// Tests anchors of a session file: the requests on an agent's bus, and the choice of the image of
// the recording.

#include "session/anchors/anchor_app.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

#include "core/keyframe.h"
#include "messages/anchor_messages.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "pangea/pose_t.hpp"

namespace pangea::session {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

constexpr int64_t kStart = 1'400'000'000'000'000;  // first image, microseconds
const MapId kMap{2, 77};

// 3 s of images at 20 Hz, 64 x 48 pixels.
fs::path Recording() {
  fs::path folder = fs::path(testing::TempDir()) / "anchor_app_recording";
  const fs::path mav0 = folder / "mav0";
  fs::remove_all(folder);
  fs::create_directories(mav0 / "cam0/data");
  fs::create_directories(mav0 / "imu0");
  const std::string identity =
      "T_BS:\n  rows: 4\n  cols: 4\n  data: [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]\n";
  std::ofstream(mav0 / "cam0/sensor.yaml")
      << identity
      << "camera_model: pinhole\nresolution: [64, 48]\nintrinsics: [60, 60, 32, 24]\n"
         "distortion_coefficients: [0, 0, 0, 0]\ndistortion_model: radial-tangential\n";
  std::ofstream(mav0 / "imu0/sensor.yaml")
      << identity
      << "rate_hz: 200\ngyroscope_noise_density: 1e-4\ngyroscope_random_walk: 2e-5\n"
         "accelerometer_noise_density: 3e-3\naccelerometer_random_walk: 4e-3\n";
  std::ofstream imu(mav0 / "imu0/data.csv");
  imu << "#t\n";
  for (int i = -20; i < 700; ++i) {
    imu << fmt::format("{}000,0,0,0,0,0,9.81\n", kStart + 5'000 * i);
  }
  std::ofstream csv(mav0 / "cam0/data.csv");
  csv << "#t\n";
  for (int i = 0; i <= 60; ++i) {
    const int64_t utime = kStart + 50'000 * i;
    csv << fmt::format("{0}000,{0}000.png\n", utime);
    cv::imwrite(mav0 / fmt::format("cam0/data/{}000.png", utime), cv::Mat(48, 64, CV_8UC1, 30.0));
  }
  return folder;
}

SessionScript Script(double at_s, const Eigen::Vector2d& pixel) {
  SessionScript script;
  AgentScript& agent = script.agents.emplace_back();
  agent.id = 2;
  agent.resolved = Recording();
  script.anchors.push_back({2, at_s, "kettle", pixel, ""});
  return script;
}

std::string Complaint(double at_s, const Eigen::Vector2d& pixel) {
  try {
    PlanAnchors(Script(at_s, pixel));
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

TEST(PlanAnchors, TakesTheImageNearestToTheTime) {
  EXPECT_EQ(PlanAnchors(Script(1.02, {63, 47})).at(0).image_utime, kStart + 1'000'000);
  EXPECT_EQ(PlanAnchors(Script(1.03, {0, 0})).at(0).image_utime, kStart + 1'050'000);
}

TEST(PlanAnchors, RefusesWhatTheRecordingDoesNotShow) {
  EXPECT_EQ(Complaint(3.5, {1, 1}),
            "anchors: kettle: 'at' is 3.5 s, and the recording of agent 2 ends at 3.0 s");
  EXPECT_THAT(Complaint(1, {70, 1}),
              HasSubstr("'pixel' [70, 1] is outside the images of agent 2: 64 x 48"));
}

TEST(PlanAnchors, RefusesATimeThatIsNotPlayed) {
  SessionScript script = Script(1, {1, 1});
  AgentScript& agent = script.agents[0];
  const auto complaint = [&script] {
    try {
      PlanAnchors(script);
    } catch (const std::runtime_error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  agent.start_s = 1.5;
  EXPECT_EQ(complaint(),
            "anchors: kettle: 'at' is 1 s, and agent 2 plays its recording from 1.5 s on");
  agent.start_s = 0.25;
  agent.duration_s = 0.5;
  EXPECT_EQ(complaint(),
            "anchors: kettle: 'at' is 1 s, and agent 2 plays its recording from 0.25 s to 0.75 s");
  agent.duration_s = 1;
  EXPECT_EQ(complaint(), "");
  agent.live = true;
  agent.start_s = 0;
  agent.duration_s = 0.5;
  EXPECT_EQ(complaint(), "") << "its duration is not the recording's";
}

class AnchorAppTest : public ::testing::Test {
 protected:
  AnchorAppTest() : app_({{{2, 1, "kettle", {3, 4}, ""}, kStart}}) {
    agent_.id = 2;
    bus_.Subscribe(channels::AnchorRequest(2), [this](const std::string&, Bytes data) {
      anchor_edit_t message{};
      ASSERT_TRUE(DecodeMessage(data, &message));
      const auto edit = Parse(message);
      ASSERT_TRUE(edit.value) << edit.refused;
      requests_.push_back(*edit.value);
    });
  }
  template <typename Message>
  void Publish(const std::string& channel, const Message& message) {
    bus_.Publish(channel, EncodeMessage(message));
    bus_.Drain();
    app_.Step();
    bus_.Drain();
  }

  LocalBus bus_;
  AnchorApp app_;
  std::vector<AnchorEdit> requests_;
  AgentScript agent_;
};

TEST_F(AnchorAppTest, APoseBringsTheRequestAndTheAnchorEndsIt) {
  app_.Join(agent_, &bus_);
  pose_t pose{};
  pose.utime = kStart;
  pose.state = pose_t::STATE_LOST;
  pose.map = ToMessage(kMap);
  Publish(channels::Pose(2), pose);
  EXPECT_THAT(requests_, IsEmpty());
  pose.state = pose_t::STATE_TRACKING;
  Publish(channels::Pose(2), pose);
  ASSERT_THAT(requests_, SizeIs(1));
  EXPECT_EQ(requests_[0].name, "kettle");
  EXPECT_EQ(requests_[0].map, kMap);
  EXPECT_EQ(requests_[0].utime, kStart);
  EXPECT_EQ(requests_[0].pixel, Eigen::Vector2d(3, 4));
  EXPECT_THAT(app_.NotPlaced(), SizeIs(1));
  AnchorState state;
  state.anchor = requests_[0].anchor;
  state.revision = 1;
  state.edited_by = 2;
  state.name = "kettle";
  state.map = state.group = kMap;
  Publish(channels::Anchor(2), ToMessage(state));
  EXPECT_THAT(app_.NotPlaced(), IsEmpty());
}

TEST_F(AnchorAppTest, OfStoredKeyframesAKeyframeDoes) {
  agent_.keyframes = "two.lcm";
  app_.Join(agent_, &bus_);
  Keyframe keyframe;
  keyframe.id = {kMap, 3};
  keyframe.utime = kStart + 100'000;
  keyframe.camera.width = keyframe.camera.height = 100;
  keyframe.camera.fx = keyframe.camera.fy = 100;
  Publish(channels::Keyframe(2), ToMessage(keyframe));
  ASSERT_THAT(requests_, SizeIs(1));
  EXPECT_EQ(requests_[0].map, kMap);
}

}  // namespace
}  // namespace pangea::session
