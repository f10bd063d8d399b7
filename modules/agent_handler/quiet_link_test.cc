// What the link does not carry: packets for an agent that is away, and again and again what the
// agent knows.

#include <gtest/gtest.h>

#include "agent_handler/link_test_world.h"
#include "messages/messages.h"
#include "messages/testing/test_keyframes.h"

namespace pangea {
namespace {

void Correct(const MapId& map, int64_t revision, Bus* server_bus) {
  Correction correction;
  correction.map = map;
  correction.group = kMap;
  correction.revision = revision;
  PublishMessage(*server_bus, "CORRECTION_1", ToMessage(correction));
}

// An uplink that hears nothing of 8 million packets could not open the next one.
TEST_F(LinkWorld, AnAgentThatIsAwayIsSentNothing) {
  PublishKeyframes(1);
  Run(3);
  int sent = 0;
  link_bus.Subscribe("LINK_DOWN_1", [&](const std::string&, Bytes) { ++sent; });
  KillUplink();
  Run(5);
  sent = 0;
  for (int i = 0; i < 20; ++i) {
    Correct(kMap, 1 + i, &server_bus);
    PublishMessage(server_bus, "OTHERS_1", ToMessage(Others{kMap, {{2, {}}}}));
    Run(0.5);
  }
  EXPECT_EQ(sent, 0);
  StartUplink();
  Run(3);
  EXPECT_GT(sent, 0);
}

// An odometry that restarted opened a second map. After each solve there are corrections of both.
TEST_F(LinkWorld, TheCorrectionOfAnEarlierMapIsConfirmedToo) {
  const MapId second{1, 5000};
  PublishKeyframes(1);
  agent_bus.Publish("KEYFRAME_1", EncodeTestKeyframe({second, 0}));
  Run(3);
  int up = 0, down = 0;
  link_bus.Subscribe("LINK_UP_1", [&](const std::string&, Bytes) { ++up; });
  link_bus.Subscribe("LINK_DOWN_1", [&](const std::string&, Bytes) { ++down; });
  Correct(kMap, 1, &server_bus);
  Correct(second, 1, &server_bus);
  Run(2);
  up = down = 0;
  Run(10);
  EXPECT_LE(up, 11) << "a hello per second";
  EXPECT_LE(down, 11);
}

}  // namespace
}  // namespace pangea
