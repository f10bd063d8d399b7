#include "agent_handler/link_test_world.h"

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "link/agent_key.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/testing/test_keyframes.h"
#include "pangea/again_t.hpp"
#include "pangea/have_t.hpp"

namespace pangea {

void LossyBus::Publish(const std::string& channel, Bytes data) {
  if (loss > 0 && Unit() < loss) {
    return;
  }
  if (held > 0 && held_.size() < kMaxHeld && Unit() < held) {
    held_.emplace_back(channel, std::vector<uint8_t>(data.begin(), data.end()));
    return;
  }
  inner.Publish(channel, data);
  if (doubled > 0 && Unit() < doubled) {
    inner.Publish(channel, data);
  }
  if (!held_.empty() && Unit() < 0.3) {
    inner.Publish(held_.back().first, held_.back().second);
    held_.pop_back();
  }
}

void SwitchedBus::Publish(const std::string& channel, Bytes data) {
  if (*on_) {
    bus_.Publish(channel, data);
  }
}

void SwitchedBus::Subscribe(const std::string& channel_regex, Handler handler) {
  bus_.Subscribe(channel_regex, [on = on_, handler](const std::string& channel, Bytes data) {
    if (*on) {
      handler(channel, data);
    }
  });
}

void LinkWorld::SetUp() {
  folder = testing::TempDir() + "pangea_link_" + std::to_string(getpid());
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder / "keys");
  MakeKeyFile(KeyFile(1), 1);
  journal_path = folder / "journal.lcm";
  // The odometry keeps its keyframes and answers requests.
  agent_bus.Subscribe(std::string(channels::kResendRequest),
                      [this](const std::string&, Bytes data) {
                        resend_request_t request{};
                        ASSERT_TRUE(DecodeMessage(data, &request));
                        const int32_t kept = Parse(request.map).value == kMap ? published : 0;
                        for (int32_t seq = std::max(request.from_seq, oldest_kept);
                             seq <= request.to_seq && seq < kept; ++seq) {
                          again_t again{};
                          again.channel = request.channel;
                          again.data = EncodeTestKeyframe({kMap, seq});
                          again.num_bytes = static_cast<int32_t>(again.data.size());
                          PublishMessage(agent_bus, channels::Again(request.requester), again);
                        }
                      });
  agent_bus.Subscribe(std::string(channels::kHave), [this](const std::string&, Bytes data) {
    have_t have{};
    ASSERT_TRUE(DecodeMessage(data, &have));
    acknowledged = have.num_maps > 0 ? have.highest_seq[0] : -1;
  });
  server_bus.Subscribe("KEYFRAME_1", [this](const std::string&, Bytes data) {
    delivered.emplace_back(data.begin(), data.end());
  });
  StartUplink();
  StartHandler();
}

void LinkWorld::TearDown() {
  handler.reset();
  std::filesystem::remove_all(folder);
}

void LinkWorld::SetAnchorRight(const std::string& word) const {
  std::ofstream(KeyFile(1), std::ios::app) << "anchors: " << word << "\n";
}

void LinkWorld::StartUplink() {
  uplink_agent_side = std::make_unique<SwitchedBus>(agent_bus);
  uplink_link_side = std::make_unique<SwitchedBus>(link_bus);
  if (spools_edits) {
    edit_spools.push_back(std::make_unique<EditSpool>(folder, 1));
  }
  uplink = std::make_unique<UplinkProcess>(*uplink_agent_side, *uplink_link_side, 1,
                                           ReadKeyFileOf(KeyFile(1), 1), options, nullptr,
                                           spools_edits ? edit_spools.back().get() : nullptr);
}

void LinkWorld::KillUplink() {
  uplink_agent_side->Off();
  uplink_link_side->Off();
  dead_uplinks.push_back(std::move(uplink));
  dead_buses.push_back(std::move(uplink_agent_side));
  dead_buses.push_back(std::move(uplink_link_side));
}

void LinkWorld::StartHandler() {
  handler_link_side = std::make_unique<SwitchedBus>(link_bus);
  handler_server_side = std::make_unique<SwitchedBus>(server_bus);
  handler =
      std::make_unique<AgentHandlerProcess>(*handler_link_side, *handler_server_side, journal_path,
                                            folder / "keys", kWall + now, handler_options);
}

void LinkWorld::KillHandler() {
  handler_link_side->Off();
  handler_server_side->Off();
  handler.reset();
  dead_buses.push_back(std::move(handler_link_side));
  dead_buses.push_back(std::move(handler_server_side));
}

void LinkWorld::PublishKeyframes(int count) {
  for (int i = 0; i < count; ++i) {
    agent_bus.Publish("KEYFRAME_1", EncodeTestKeyframe({kMap, published++}));
  }
}

void LinkWorld::Run(double seconds) {
  const int64_t end = now + static_cast<int64_t>(seconds * 1e6);
  for (; now < end; now += 5'000) {
    agent_bus.Drain();
    if (uplink) {
      uplink->Poll(now);
    }
    link_bus.inner.Drain();
    if (handler) {
      handler->Poll(now);
    }
    if (now % 100'000 == 0) {
      if (uplink) {
        uplink->Tick(kWall + now);
      }
      if (handler) {
        handler->Tick(kWall + now);
      }
    }
    link_bus.inner.Drain();
    server_bus.Drain();
    agent_bus.Drain();
  }
}

void LinkWorld::ExpectDelivered(int count) const {
  ASSERT_EQ(delivered.size(), static_cast<size_t>(count));
  for (int seq = 0; seq < count; ++seq) {
    EXPECT_EQ(delivered[static_cast<size_t>(seq)], EncodeTestKeyframe({kMap, seq})) << seq;
  }
}

}  // namespace pangea
