// The real programs over UDP multicast on loopback: two agents, handler and uplink killed in
// between.

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <random>
#include <set>

#include "agent_handler/journal/journal.h"
#include "bus/process.h"
#include "bus/transport/test_datagrams.h"
#include "core/testing/program.h"
#include "link/agent_key.h"
#include "messages/channels.h"
#include "messages/testing/test_keyframes.h"
#include "pangea/again_t.hpp"
#include "pangea/have_t.hpp"
#include "pangea/resend_request_t.hpp"

namespace pangea {
namespace {

using Clock = std::chrono::steady_clock;

// An odometry at full speed: it waits until its uplink listens (nobody would tell that one of the
// keyframes before, as a real odometry's next one does), and while 30 keyframes are not
// acknowledged, and answers requests.
struct Agent {
  static constexpr int kMaxAhead = 30;

  Agent(int32_t agent_id, const std::string& url) : id(agent_id), map{id, 1000}, bus(url) {
    bus.Subscribe(std::string(channels::kHave), [this](const std::string&, Bytes data) {
      have_t have{};
      uplink_listens = true;
      if (DecodeMessage(data, &have) && have.num_maps == 1) {
        acknowledged = have.highest_seq[0];
      }
    });
    bus.Subscribe(std::string(channels::kResendRequest), [this](const std::string&, Bytes data) {
      resend_request_t request{};
      ASSERT_TRUE(DecodeMessage(data, &request));
      for (int32_t seq = request.from_seq; seq <= request.to_seq && seq < published; ++seq) {
        again_t again{};
        again.channel = request.channel;
        again.data = EncodeTestKeyframe({map, seq});
        again.num_bytes = static_cast<int32_t>(again.data.size());
        PublishMessage(bus, channels::Again(request.requester), again);
      }
    });
  }
  void PublishUpTo(int32_t count) {
    if (uplink_listens && published < count && published - acknowledged < kMaxAhead) {
      bus.Publish(channels::Keyframe(id), EncodeTestKeyframe({map, published++}));
    }
  }
  int32_t id;
  MapId map;
  LcmBus bus;
  int32_t published = 0;
  int32_t acknowledged = -1;
  bool uplink_listens = false;
};

// LCM's own relay for TCP.
std::unique_ptr<Program> StartRelay(int port) {
  return std::make_unique<Program>(
      std::vector<std::string>{"/usr/bin/env", "java", "-cp", "/usr/share/java/lcm.jar",
                               "lcm.lcm.TCPService", std::to_string(port)});
}

// Over multicast, or through a relay that is killed too.
class LinkSystem : public testing::TestWithParam<bool> {};

TEST_P(LinkSystem, TwoAgentsDeliverThroughKilledProcesses) {
  constexpr int kKeyframes = 150;
  std::random_device device;  // only for the addresses, which must not meet another run's
  const int relay_port = GetParam() ? static_cast<int>(20000 + device() % 12000) : 0;
  const std::string link =
      relay_port != 0 ? fmt::format("tcpq://127.0.0.1:{}", relay_port) : OwnBusUrl();
  const std::string server = OwnBusUrl();
  const std::string agent_urls[] = {OwnBusUrl(), OwnBusUrl()};
  const std::string journal = testing::TempDir() + fmt::format("pangea_system_{}.lcm", getpid());
  std::filesystem::remove(journal);
  const std::filesystem::path keys = testing::TempDir() + fmt::format("pangea_system_{}", getpid());
  std::filesystem::create_directories(keys);
  for (const int agent_id : {1, 2}) {
    MakeKeyFile(keys / KeyFileName(agent_id), agent_id);
  }
  const std::string bin = std::string(PANGEA_BINARY_DIR) + "/bin/";

  const auto start_handler = [&] {
    return std::make_unique<Program>(
        std::vector<std::string>{bin + "pangea-agent-handler", "--link", link, "--server", server,
                                 "--journal", journal, "--keys", keys.string()});
  };
  auto relay = relay_port != 0 ? StartRelay(relay_port) : nullptr;
  auto handler = start_handler();
  const auto start_uplink = [&](int i) {
    return std::make_unique<Program>(std::vector<std::string>{
        bin + "pangea-uplink", "--agent", std::to_string(i + 1), "--key",
        (keys / KeyFileName(i + 1)).string(), "--bus", agent_urls[i], "--link", link});
  };
  std::vector<std::unique_ptr<Program>> uplinks;
  std::vector<std::unique_ptr<Agent>> agents;
  for (int i = 0; i < 2; ++i) {
    agents.push_back(std::make_unique<Agent>(i + 1, agent_urls[i]));
    uplinks.push_back(start_uplink(i));
  }
  LcmBus server_bus(server);
  std::set<std::string> seen;
  server_bus.Subscribe("(KEYFRAME_1|KEYFRAME_2)", [&](const std::string&, Bytes data) {
    seen.emplace(data.begin(), data.end());
  });

  bool handler_killed = false, uplink_killed = false, relay_killed = relay_port == 0;
  const auto begin = Clock::now();
  const auto deadline = begin + std::chrono::seconds(20);
  const auto done = [&] {
    return agents[0]->acknowledged == kKeyframes - 1 && agents[1]->acknowledged == kKeyframes - 1;
  };
  while (!done() && Clock::now() < deadline) {
    for (auto& agent : agents) {
      agent->PublishUpTo(kKeyframes);
    }
    server_bus.Handle(1);
    for (auto& agent : agents) {
      while (agent->bus.Handle(0)) {
      }
    }
    if (!relay_killed && agents[0]->acknowledged > 90) {
      relay->End(SIGKILL);
      relay = StartRelay(relay_port);
      relay_killed = true;
    }
    if (!handler_killed && agents[0]->acknowledged > 30) {
      handler->End(SIGKILL);
      handler = start_handler();
      handler_killed = true;
    }
    if (!uplink_killed && agents[1]->acknowledged > 60) {
      uplinks[1]->End(SIGKILL);
      uplinks[1] = start_uplink(1);
      uplink_killed = true;
    }
  }
  const double seconds = std::chrono::duration<double>(Clock::now() - begin).count();
  EXPECT_TRUE(done()) << agents[0]->acknowledged << " and " << agents[1]->acknowledged;
  while (server_bus.Handle(100)) {
  }
  RecordProperty("seconds", std::to_string(seconds));

  for (auto& uplink : uplinks) {
    EXPECT_EQ(uplink->End(SIGTERM), 0);
  }
  EXPECT_EQ(handler->End(SIGTERM), 0);
  std::map<std::string, int32_t> next;
  const Journal read(journal, [&](const std::string& channel, Bytes data, const JournalPlace&) {
    if (channel == channels::Options("agent_handler")) {
      ++next[channel];
      return true;
    }
    KeyframeMessage keyframe{};
    EXPECT_TRUE(DecodeMessage(data, &keyframe));
    EXPECT_EQ(keyframe.id.seq, next[channel]++) << channel;
    return true;
  });
  EXPECT_EQ(next["KEYFRAME_1"], kKeyframes);
  EXPECT_EQ(next["KEYFRAME_2"], kKeyframes);
  EXPECT_EQ(next["OPTIONS_agent_handler"], 1) << "both starts had the same";
  // What was journalled but not yet published when the handler was killed is served, not seen.
  EXPECT_GE(seen.size(), 2u * kKeyframes - 32);
  std::filesystem::remove(journal);
  std::filesystem::remove_all(keys);
}

INSTANTIATE_TEST_SUITE_P(Buses, LinkSystem, testing::Bool());

}  // namespace
}  // namespace pangea
