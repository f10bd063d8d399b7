// Tests the agent_handler with bad input from strangers, broken agents and broken processes.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <random>
#include <set>

#include "agent_handler/link_test_world.h"
#include "files/testing/full_disk.h"
#include "link/agent_key.h"
#include "link/anchor_wire.h"
#include "messages/encoding.h"
#include "messages/testing/test_anchors.h"
#include "messages/testing/test_keyframes.h"
#include "pangea/again_t.hpp"
#include "pangea/pose_t.hpp"
#include "pangea/status_t.hpp"

namespace pangea {
namespace {

// Each class of a hostile field shows by its reason in STATUS_*, and nothing else comes of it.
TEST_F(LinkWorld, RefusalsShowInTheStatus) {
  std::map<std::string, std::set<std::string>> refused;
  const auto listen = [&](Bus& bus) {
    bus.Subscribe("STATUS_.*", [&](const std::string& channel, Bytes data) {
      status_t status{};
      ASSERT_TRUE(DecodeMessage(data, &status));
      for (const counter_t& reason : status.refused) {
        refused[channel].insert(reason.name);
      }
    });
  };
  listen(agent_bus);
  listen(server_bus);
  PublishKeyframes(2);
  Run(2);
  const auto publish = [&](int32_t seq, const std::function<void(KeyframeMessage*)>& damage) {
    KeyframeMessage message = ToMessage(TestKeyframe({kMap, seq}));
    damage(&message);
    PublishMessage(agent_bus, "KEYFRAME_1", message);
  };
  publish(2, [](KeyframeMessage* m) { m->v_odom_body.x = std::nan(""); });
  publish(2, [](KeyframeMessage* m) {
    m->T_odom_body.translation.z = std::numeric_limits<double>::infinity();
  });
  publish(2, [](KeyframeMessage* m) { m->camera.height = 1 << 30; });
  publish(2, [](KeyframeMessage* m) { m->camera.fx += 100; });
  publish(2, [](KeyframeMessage* m) { m->utime = 1; });
  publish(1, [](KeyframeMessage* m) { m->v_odom_body.x += 1; });
  PublishMessage(server_bus, "RESEND_REQUEST", resend_request_t{});
  Constraint result;
  result.from = {kMap, 0};
  result.to = {kMap, 1};
  constraint_t forged = ToMessage(result);
  forged.id += 1;
  PublishMessage(server_bus, "CONSTRAINT", forged);
  link_bus.Publish("LINK_UP_1", std::vector<uint8_t>(50, 7));
  Run(3);
  EXPECT_THAT(refused["STATUS_uplink_1"],
              testing::UnorderedElementsAre("velocity or biases out of range",
                                            "T_odom_body: translation out of range",
                                            "camera: image size must be 16 to 2047 pixels",
                                            "keyframe with another camera than its map's",
                                            "keyframe's time does not go forward with its seq",
                                            "keyframe seq used again for another keyframe"));
  EXPECT_THAT(refused["STATUS_agent_handler"],
              testing::IsSupersetOf({"resend request: requester, map or range is invalid",
                                     "constraint: id does not follow from its keyframes"}));
  EXPECT_GE(refused["STATUS_agent_handler"].size(), 3u) << "and the link's noise";
  ExpectDelivered(2);
}

// After a restart the handler still checks a map's new keyframes against the journalled ones.
TEST_F(LinkWorld, AMapGoesOnFromItsJournalledKeyframes) {
  PublishKeyframes(3);
  Run(3);
  KillUplink();
  KillHandler();
  StartHandler();
  StartUplink();
  std::set<std::string> refused;
  server_bus.Subscribe("STATUS_agent_handler", [&](const std::string&, Bytes data) {
    status_t status{};
    ASSERT_TRUE(DecodeMessage(data, &status));
    for (const counter_t& reason : status.refused) {
      refused.insert(reason.name);
    }
  });
  Run(2);
  KeyframeMessage early = ToMessage(TestKeyframe({kMap, 3}));
  early.utime = 1;
  PublishMessage(agent_bus, "KEYFRAME_1", early);
  Run(3);
  EXPECT_THAT(refused, testing::Contains("keyframe's time does not go forward with its seq"));
  ExpectDelivered(3);
}

// Everything that ever crossed the link again: as it was, changed, to another agent, turned back,
// after either side has restarted.
TEST_F(LinkWorld, StrangersAreDroppedAndCounted) {
  MakeKeyFile(KeyFile(2), 2);
  std::vector<std::pair<std::string, std::vector<uint8_t>>> recorded;
  bool recording = true;
  link_bus.Subscribe("LINK_.*", [&](const std::string& channel, Bytes data) {
    if (recording) {
      recorded.emplace_back(channel, std::vector<uint8_t>(data.begin(), data.end()));
    }
  });
  std::map<std::string, int64_t> refused, counters;
  server_bus.Subscribe("STATUS_agent_handler", [&](const std::string&, Bytes data) {
    status_t status{};
    ASSERT_TRUE(DecodeMessage(data, &status));
    for (const counter_t& counter : status.refused) {
      refused[counter.name] = counter.count;
    }
    for (const counter_t& counter : status.counters) {
      counters[counter.name] = counter.count;
    }
  });
  int poses = 0;
  server_bus.Subscribe("POSE_.*", [&](const std::string&, Bytes) { ++poses; });
  const auto shout = [&] {
    recording = false;
    for (const auto& [channel, data] : recorded) {
      std::vector<uint8_t> changed = data;
      changed[data.size() / 2] ^= 1;
      link_bus.Publish(channel, data);
      link_bus.Publish(channel, changed);
      for (const char* other : {"LINK_UP_1", "LINK_UP_2", "LINK_UP_3", "LINK_DOWN_1"}) {
        if (channel != other) {
          link_bus.Publish(other, data);
        }
      }
      Run(0.005);
    }
  };
  PublishKeyframes(5);
  Run(3);
  const int64_t accepted = counters.at("packets_1");
  const auto sent = std::count_if(recorded.begin(), recorded.end(),
                                  [](const auto& item) { return item.first == "LINK_UP_1"; });
  EXPECT_LE(accepted, sent);
  EXPECT_GT(accepted, sent / 2);
  shout();
  Run(2);
  EXPECT_EQ(refused["packet of agent 3, whose key is not in the folder of keys"],
            static_cast<int64_t>(recorded.size()));
  EXPECT_GT(refused["repeated or too old"], 50);
  EXPECT_GT(
      refused["not sealed for this session: forged, damaged, of an earlier one, or of a second "
              "uplink of this agent"],
      0);
  EXPECT_GT(refused["packet before there is a session"], 50) << "agent 2 has a key, but no uplink";
  EXPECT_GT(refused["hello is forged or damaged"], 0);
  EXPECT_LE(counters.at("packets_1"), accepted + 10) << "the uplink's hellos alone";
  EXPECT_EQ(counters.at("agents"), 1);
  EXPECT_EQ(counters.at("agents_with_key"), 2);
  KillHandler();
  StartHandler();
  shout();
  KillUplink();
  StartUplink();
  shout();
  EXPECT_EQ(poses, 0);
  PublishKeyframes(5);
  Run(5);
  ExpectDelivered(10);
}

TEST_F(LinkWorld, AnAgentIsShutOutWithItsKey) {
  PublishKeyframes(2);
  Run(3);
  ExpectDelivered(2);
  std::filesystem::rename(KeyFile(1), folder / "away");
  Run(2);
  PublishKeyframes(2);
  Run(5);
  EXPECT_EQ(delivered.size(), 2u);
  std::filesystem::rename(folder / "away", KeyFile(1));
  Run(10);
  ExpectDelivered(4);
}

// Its keyframes wait for the disk meanwhile, and the journal does not have them yet.
TEST_F(LinkWorld, AnAgentThatComesBackIsAskedForNothingTwice) {
  Run(2);
  {
    const FullDisk full(std::filesystem::file_size(journal_path));
    PublishKeyframes(2);
    Run(2);
    std::filesystem::rename(KeyFile(1), folder / "away");
    Run(2);
    std::filesystem::rename(folder / "away", KeyFile(1));
    Run(3);
  }
  Run(5);
  ExpectDelivered(2);
  EXPECT_EQ(acknowledged, 1);
}

// Its texts could not be encoded again: the journal would not read them at its next start.
TEST_F(LinkWorld, AnEditWithAZeroByteIsRefused) {
  MakeKeyFile(KeyFile(2), 2);
  UplinkSession session(2, ReadKeyFileOf(KeyFile(2), 2));
  link_bus.Subscribe("LINK_DOWN_2", [&](const std::string&, Bytes data) { session.Open(data); });
  std::string summary;
  server_bus.Subscribe("STATUS_agent_handler", [&](const std::string&, Bytes data) {
    status_t status{};
    ASSERT_TRUE(DecodeMessage(data, &status));
    summary = status.summary;
  });
  Run(2);
  for (int64_t number = 1; number < 4; ++number) {
    link_bus.Publish("LINK_UP_2", session.Seal({LinkKind::kHello, number,
                                                Encode(LinkHello{OurSoftware(), {}})}));
    Run(1);
  }
  AnchorEdit edit = TestEdit({2, 5}, 1, 2);
  edit.payload = "a~b";
  std::vector<uint8_t> body = EncodeAnchorEdit(edit);
  *std::ranges::find(body, '~') = 0;
  link_bus.Publish("LINK_UP_2", session.Seal({LinkKind::kAnchorEdit, 4, body}));
  Run(2);
  KillHandler();
  StartHandler();
  Run(5);  // the uplink waits 3 s for the handler that it knew
  EXPECT_EQ(summary, "1 agents, 0 keyframes in the journal") << "and no damage";
}

// A key that is half written, or another that others may read, must not keep one in.
TEST_F(LinkWorld, AnAgentIsShutOutThoughAnotherKeyIsBad) {
  PublishKeyframes(2);
  Run(3);
  std::ofstream(KeyFile(2)) << "agent: 2\nkey: 12";
  Run(2);
  PublishKeyframes(2);
  Run(3);
  ExpectDelivered(4);
  std::string summary;
  server_bus.Subscribe("STATUS_agent_handler", [&](const std::string&, Bytes data) {
    status_t status{};
    ASSERT_TRUE(DecodeMessage(data, &status));
    summary = status.summary;
  });
  KillHandler();
  StartHandler();  // which takes the good keys
  PublishKeyframes(2);
  Run(3);
  EXPECT_EQ(delivered.size(), 6u);
  EXPECT_THAT(summary, testing::HasSubstr("1 of the key files cannot be used: key file " +
                                          KeyFile(2).string()));
  std::filesystem::remove(KeyFile(1));
  Run(2);
  PublishKeyframes(2);
  Run(5);
  EXPECT_EQ(delivered.size(), 6u);
  EXPECT_THAT(summary, testing::HasSubstr("the folder of keys is empty: nobody can join"));
}

// But forged ones must not take the place of all other reasons.
TEST_F(LinkWorld, AgentsWithoutAKeyAreNamed) {
  std::set<std::string> refused;
  server_bus.Subscribe("STATUS_agent_handler", [&](const std::string&, Bytes data) {
    status_t status{};
    ASSERT_TRUE(DecodeMessage(data, &status));
    for (const counter_t& reason : status.refused) {
      refused.insert(reason.name);
    }
  });
  for (int32_t agent = 3; agent < 200; ++agent) {
    link_bus.Publish(channels::LinkUp(agent), std::vector<uint8_t>(100));
  }
  Run(2);
  EXPECT_TRUE(refused.contains("packet of agent 3, whose key is not in the folder of keys"));
  EXPECT_TRUE(refused.contains("packet of agent 4, whose key is not in the folder of keys"));
  EXPECT_TRUE(refused.contains("packet of an agent whose key is not in the folder of keys"));
  EXPECT_LE(refused.size(), 15u);
}

TEST_F(LinkWorld, AnAgentOfAnotherVersionIsNamedInTheStatus) {
  MakeKeyFile(KeyFile(2), 2);
  std::string summary;
  server_bus.Subscribe("STATUS_agent_handler", [&](const std::string&, Bytes data) {
    status_t status{};
    ASSERT_TRUE(DecodeMessage(data, &status));
    summary = status.summary;
  });
  UplinkSession session(2, ReadKeyFileOf(KeyFile(2), 2));
  link_bus.Subscribe("LINK_DOWN_2", [&](const std::string&, Bytes data) { session.Open(data); });
  PublishKeyframes(1);
  Run(3);
  EXPECT_EQ(summary, "1 agents, 1 keyframes in the journal");
  for (int64_t number = 1; number < 4; ++number) {
    link_bus.Publish("LINK_UP_2", session.Seal({LinkKind::kHello, number,
                                                Encode(LinkHello{"pangea 0.0.1", {}})}));
    Run(1);
  }
  EXPECT_EQ(summary, "2 agents, 1 keyframes in the journal; agent 2 runs pangea 0.0.1, not " +
                         OurSoftware());
}

TEST_F(LinkWorld, AnUplinkWithAnotherKeyGetsNothingAndBothStatusesSaySo) {
  std::string uplink_says, handler_says;
  const auto hear = [](Bus& bus, const char* channel, std::string* summary) {
    bus.Subscribe(channel, [summary](const std::string&, Bytes data) {
      status_t status{};
      ASSERT_TRUE(DecodeMessage(data, &status));
      *summary = status.summary;
    });
  };
  hear(agent_bus, "STATUS_uplink_1", &uplink_says);
  hear(server_bus, "STATUS_agent_handler", &handler_says);
  Run(3);
  EXPECT_THAT(uplink_says, testing::StartsWith("connected"));
  KillUplink();
  std::filesystem::rename(KeyFile(1), folder / "server.key");
  MakeKeyFile(KeyFile(1), 1);
  StartUplink();
  std::filesystem::remove(KeyFile(1));
  std::filesystem::rename(folder / "server.key", KeyFile(1));
  PublishKeyframes(2);
  Run(10);
  EXPECT_TRUE(delivered.empty());
  EXPECT_THAT(uplink_says, testing::HasSubstr("its key for agent 1 is not ours"));
  EXPECT_THAT(handler_says, testing::HasSubstr("hellos of agent 1 do not open: its key is not"));
  KillUplink();
  StartUplink();  // with the server's key
  Run(3);
  EXPECT_THAT(uplink_says, testing::StartsWith("connected"));
  EXPECT_THAT(handler_says, testing::Not(testing::HasSubstr("do not open")));
}

// Noise, and every message with damaged bytes, on every channel that is listened to.
TEST_F(LinkWorld, ArbitraryMessagesCrashNoProcess) {
  std::vector<std::vector<uint8_t>> link_messages;
  link_bus.Subscribe("LINK_.*", [&](const std::string&, Bytes data) {
    if (link_messages.size() < 50) {
      link_messages.emplace_back(data.begin(), data.end());
    }
  });
  PublishKeyframes(5);
  Run(2);
  std::vector<std::vector<uint8_t>> payloads = link_messages;
  payloads.push_back(EncodeTestKeyframe({kMap, 6}));
  payloads.push_back(EncodeMessage(pose_t{}));
  payloads.push_back(EncodeMessage(ToMessage(Constraint{})));
  payloads.push_back(EncodeMessage(ToMessage(PlaceMatch{})));
  payloads.push_back(EncodeMessage(landmarks_t{}));
  payloads.push_back(EncodeMessage(again_t{}));
  std::mt19937_64 rng(8);
  for (int i = 0; i < 3000; ++i) {
    std::vector<uint8_t> data = payloads[rng() % payloads.size()];
    for (int flips = static_cast<int>(rng() % 4); flips >= 0; --flips) {
      data[rng() % std::min<size_t>(data.size(), 120)] ^= static_cast<uint8_t>(1 + rng() % 255);
    }
    data.resize(rng() % 5 == 0 ? rng() % data.size() : data.size());
    for (const char* channel : {"KEYFRAME_1", "POSE_1", "AGAIN_uplink_1"}) {
      agent_bus.Publish(channel, data);
    }
    for (const char* channel : {"LINK_UP_1", "LINK_UP_7", "LINK_DOWN_1"}) {
      link_bus.Publish(channel, data);
    }
    for (const char* channel : {"PLACE_MATCH", "CONSTRAINT", "CORRECTION_1", "LANDMARKS_1",
                                "RESEND_REQUEST", "VERDICT_REQUEST", "AGAIN_agent_handler"}) {
      server_bus.Publish(channel, data);
    }
    if (i % 100 == 0) {
      Run(0.01);
    }
  }
  PublishKeyframes(5);
  Run(30);
  EXPECT_GE(acknowledged, 9);
}

}  // namespace
}  // namespace pangea
