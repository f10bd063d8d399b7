// A rendered recording through the agent, and through pangea-vio's own player.

#include <gtest/gtest.h>

#include <vector>

#include "phone/agent/phone_agent.h"
#include "recording/euroc.h"
#include "vio/playback.h"

namespace pangea::phone {
namespace {

constexpr int64_t kOpened_utime = 1'700'000'000'000'000;

using Messages = std::vector<std::vector<uint8_t>>;

Messages PlayedByVio(const EurocRecording& recording) {
  Messages keyframes;
  LocalBus bus;
  bus.Subscribe("KEYFRAME_7", [&keyframes](const std::string&, Bytes data) {
    keyframes.emplace_back(data.begin(), data.end());
  });
  vio::VioProcessOptions options;
  options.agent_id = 7;
  options.map_utime = kOpened_utime;
  vio::VioProcess process(bus, options, kOpened_utime);
  process.Open(recording.camera(), recording.imu_noise(), recording.calibration_sigmas());
  vio::PlaybackOptions playback;
  playback.rate = 0;
  vio::Playback(nullptr, process, recording, playback).Run();
  bus.Drain();
  return keyframes;
}

TEST(PhoneAgentRecordingTest, GivesTheSameKeyframesAsPangeaVio) {
  const EurocRecording recording(std::string(PANGEA_BINARY_DIR) + "/tests/walk_1");
  AgentConfig config;
  config.agent_id = 7;
  config.opened_utime = kOpened_utime;
  config.camera = recording.camera();
  config.sigmas = recording.calibration_sigmas();
  config.imu_noise = recording.imu_noise();
  PhoneAgent agent(config);
  Messages keyframes;
  int tracked = 0;
  const auto take = [&] {
    const PhoneEvents events = agent.Take();
    keyframes.insert(keyframes.end(), events.keyframes.begin(), events.keyframes.end());
    tracked += events.pose && events.pose->state == pose_t::STATE_TRACKING ? 1 : 0;
  };
  size_t next_imu = 0;
  for (size_t i = 0; i < recording.images().size(); ++i) {
    const int64_t utime = recording.images()[i].utime;
    std::string why;
    agent.AddImage(utime, recording.LoadImage(i, &why));
    for (; next_imu < recording.imu().size() && recording.imu()[next_imu].utime <= utime + 60'000;
         ++next_imu) {
      agent.AddImu(recording.imu()[next_imu]);
    }
    agent.Poll(kOpened_utime + utime);
    take();
  }
  agent.Flush();
  take();
  EXPECT_GT(tracked, 100);
  ASSERT_GT(keyframes.size(), 10u);
  EXPECT_EQ(keyframes, PlayedByVio(recording));
}

}  // namespace
}  // namespace pangea::phone
