// Messages that are sent to an agent once and not repeated: landmarks, positions of the other
// agents.

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "agent_handler/link_test_world.h"
#include "messages/encoding.h"
#include "messages/messages.h"

namespace pangea {
namespace {

TEST_F(LinkWorld, LandmarksReachTheirAgentAlone) {
  std::vector<landmarks_t> told;
  agent_bus.Subscribe("LANDMARKS_1", [&](const std::string&, Bytes data) {
    ASSERT_TRUE(DecodeMessage(data, &told.emplace_back()));
  });
  PublishKeyframes(1);
  Run(3);
  MapLandmarks landmarks{kMap, {2, 500}, 3, {{{{2, 500}, 8}, {1, 0, 0}}}, {}};
  for (int i = 0; i < 18; ++i) {
    landmarks.landmarks.push_back({0, i, {5, 0.1 * i, 1}, 0.05, 0.01, {}});
  }
  PublishMessage(server_bus, "LANDMARKS_1", ToMessage(landmarks));
  Run(1);
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0].num_landmarks, 18);
  // Another agent's, one that is not sound, and one that no frame would hold.
  landmarks.map = {9, 1000};
  PublishMessage(server_bus, "LANDMARKS_9", ToMessage(landmarks));
  landmarks.map = kMap;
  landmarks_t hostile = ToMessage(landmarks);
  hostile.landmarks[3].sigma_along_m = -1;
  PublishMessage(server_bus, "LANDMARKS_1", hostile);
  landmarks.landmarks.resize(60, landmarks.landmarks.front());
  PublishMessage(server_bus, "LANDMARKS_1", ToMessage(landmarks));
  Run(1);
  EXPECT_EQ(told.size(), 1u);
}

TEST_F(LinkWorld, OthersReachTheirAgentAloneAndTheNewestCount) {
  std::vector<double> told;
  agent_bus.Subscribe("OTHERS_1", [&](const std::string&, Bytes data) {
    others_t message{};
    ASSERT_TRUE(DecodeMessage(data, &message));
    told.push_back(message.others.at(0).T_odom_cam.translation.x);
  });
  PublishKeyframes(1);
  Run(3);
  link_bus.held = 0.5;  // packets overtake each other
  Others others{kMap, {{2, {}}}};
  for (int i = 0; i < 100; ++i) {
    others.others[0].T_odom_cam.t.x() = i;
    PublishMessage(server_bus, "OTHERS_1", ToMessage(others));
    Run(0.05);
  }
  EXPECT_GT(told.size(), 40u);
  EXPECT_LT(told.size(), 100u);
  EXPECT_TRUE(std::ranges::is_sorted(told));
  link_bus.held = 0;
  Run(10);  // until none is held any more
  told.clear();
  others.map = {9, 1000};
  PublishMessage(server_bus, "OTHERS_9", ToMessage(others));
  others.map = kMap;
  others_t hostile = ToMessage(others);
  hostile.others[0].agent_id = 1;
  PublishMessage(server_bus, "OTHERS_1", hostile);
  Run(1);
  EXPECT_TRUE(told.empty());
}

}  // namespace
}  // namespace pangea
