// Two servers that have the agent's key, on one link bus: an operator's mistake, for example a copy
// of a site on a second host. Each would acknowledge a part of the keyframes.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "agent_handler/link_test_world.h"
#include "messages/channels.h"
#include "pangea/status_t.hpp"

namespace pangea {
namespace {

class TwoServersTest : public LinkWorld {
 protected:
  // Run, with the second server too.
  void RunBoth(double seconds) {
    const int64_t end = now + static_cast<int64_t>(seconds * 1e6);
    while (now < end) {
      Run(0.01);
      second->Poll(now);
      second->Tick(kWall + now);
      second_bus.Drain();
    }
  }
  void StartSecond() {
    second = std::make_unique<AgentHandlerProcess>(link_bus, second_bus, folder / "second.lcm",
                                                   folder / "keys", kWall + now, handler_options);
    second_bus.Subscribe("KEYFRAME_1", [this](const std::string&, Bytes) { ++second_delivered; });
  }

  LocalBus second_bus;
  std::unique_ptr<AgentHandlerProcess> second;
  int second_delivered = 0;
};

TEST_F(TwoServersTest, TheSecondTakesNoKeyframesAndIsNamed) {
  std::string refused;
  agent_bus.Subscribe(channels::Status("uplink_1"), [&](const std::string&, Bytes data) {
    status_t status{};
    ASSERT_TRUE(DecodeMessage(data, &status));
    for (const counter_t& counter : status.refused) {
      refused += counter.name;
    }
  });
  PublishKeyframes(10);
  Run(5);
  EXPECT_EQ(acknowledged, 9);
  StartSecond();
  for (int i = 0; i < 20; ++i) {
    PublishKeyframes(2);
    RunBoth(0.5);
  }
  RunBoth(5);
  EXPECT_EQ(acknowledged, 49);
  ExpectDelivered(50);
  EXPECT_EQ(second_delivered, 0);
  EXPECT_THAT(refused, testing::HasSubstr("a second server"));
}

// When the first one ends, the second one takes over, as a standby server does.
TEST_F(TwoServersTest, TheSecondTakesOver) {
  PublishKeyframes(5);
  Run(5);
  StartSecond();
  RunBoth(2);
  KillHandler();
  PublishKeyframes(5);
  RunBoth(10);
  EXPECT_EQ(acknowledged, 9);
  EXPECT_GE(second_delivered, 5);
}

}  // namespace
}  // namespace pangea
