// A rendered recording through the agent, and through pangea-vio's own player.

#include <gtest/gtest.h>

#include <optional>
#include <vector>

#include "bus/node.h"
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

struct Played {
  Messages keyframes;
  int tracked = 0;                  // images with a pose
  std::optional<int64_t> repeated;  // images that the agent took for copies
};

// `copies`: of each image, 10 ms apart, as a browser shows those of a slow camera.
Played PlayedByAgent(const EurocRecording& recording, int copies) {
  AgentConfig config;
  config.agent_id = 7;
  config.opened_utime = kOpened_utime;
  config.camera = recording.camera();
  config.sigmas = recording.calibration_sigmas();
  config.imu_noise = recording.imu_noise();
  PhoneAgent agent(config);
  Played played;
  const auto take = [&] {
    const PhoneEvents events = agent.Take();
    played.keyframes.insert(played.keyframes.end(), events.keyframes.begin(),
                            events.keyframes.end());
    played.tracked += events.pose && events.pose->state == pose_t::STATE_TRACKING ? 1 : 0;
    if (events.vio_status) {
      played.repeated = CounterOf(*events.vio_status, "images_repeated");
    }
  };
  size_t next_imu = 0;
  for (size_t i = 0; i < recording.images().size(); ++i) {
    std::string why;
    const cv::Mat image = recording.LoadImage(i, &why);
    for (int copy = 0; copy < copies; ++copy) {
      const int64_t utime = recording.images()[i].utime + 10'000 * copy;
      agent.AddImage(utime, image);
      for (; next_imu < recording.imu().size() && recording.imu()[next_imu].utime <= utime + 60'000;
           ++next_imu) {
        agent.AddImu(recording.imu()[next_imu]);
      }
      agent.Poll(kOpened_utime + utime);
      take();
    }
  }
  agent.Flush();
  take();
  return played;
}

TEST(PhoneAgentRecordingTest, GivesTheSameKeyframesAsPangeaVio) {
  const EurocRecording recording(std::string(PANGEA_BINARY_DIR) + "/tests/walk_1");
  const Played played = PlayedByAgent(recording, 1);
  EXPECT_GT(played.tracked, 100);
  EXPECT_FALSE(played.repeated);
  ASSERT_GT(played.keyframes.size(), 10u);
  EXPECT_EQ(played.keyframes, PlayedByVio(recording));
}

TEST(PhoneAgentRecordingTest, CopiesOfAnImageAreCountedAndHaveNoPose) {
  const EurocRecording recording(std::string(PANGEA_BINARY_DIR) + "/tests/walk_1");
  const Played once = PlayedByAgent(recording, 1);
  const Played twice = PlayedByAgent(recording, 2);
  EXPECT_EQ(twice.tracked, once.tracked);
  EXPECT_EQ(twice.keyframes.size(), once.keyframes.size());
  EXPECT_GT(twice.repeated.value_or(0), once.tracked - 25)
      << "the status is published once a second";
}

}  // namespace
}  // namespace pangea::phone
