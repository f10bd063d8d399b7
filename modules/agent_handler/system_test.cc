// The real programs over UDP multicast on loopback: two agents, handler and uplink killed in
// between.

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <map>
#include <random>
#include <set>

#include "agent_handler/journal/journal.h"
#include "bus/process.h"
#include "bus/transport/test_datagrams.h"
#include "core/testing/program.h"
#include "link/agent_key.h"
#include "messages/channels.h"
#include "messages/encoding.h"
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

  Agent(int32_t agent_id, const std::string& bus_url)
      : id(agent_id), map{id, 1000}, url(bus_url), bus(url) {
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
  std::string url;
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

// The handler, two agents with their uplinks, and what somebody on the server's bus sees.
class LinkedAgents {
 public:
  explicit LinkedAgents(bool with_relay) : relay_port_(with_relay ? 20000 + Random() % 12000 : 0) {
    std::filesystem::remove(journal_);
    std::filesystem::create_directories(keys_);
    for (const int agent_id : {1, 2}) {
      MakeKeyFile(KeyOf(agent_id), agent_id);
    }
    if (with_relay) {
      relay_ = StartRelay(relay_port_);
    }
    handler_ = StartHandler();
    for (const int agent_id : {1, 2}) {
      agents_.push_back(std::make_unique<Agent>(agent_id, OwnBusUrl()));
      uplinks_.push_back(StartUplink(agent_id));
    }
    server_bus_.Subscribe("(KEYFRAME_1|KEYFRAME_2)", [this](const std::string&, Bytes data) {
      seen_.emplace(data.begin(), data.end());
    });
  }
  ~LinkedAgents() {
    std::filesystem::remove(journal_);
    std::filesystem::remove_all(keys_);
  }

  // Keyframes of each agent up to `count`; kills each process once on the way.
  void Run(int32_t count) {
    const auto deadline = Clock::now() + std::chrono::seconds(20);
    while (Acknowledged() < count && Clock::now() < deadline) {
      for (auto& agent : agents_) {
        agent->PublishUpTo(count);
      }
      server_bus_.Handle(1);
      for (auto& agent : agents_) {
        while (agent->bus.Handle(0)) {
        }
      }
      KillDue();
    }
    while (server_bus_.Handle(100)) {
    }
  }
  void End() {
    for (auto& uplink : uplinks_) {
      EXPECT_EQ(uplink->End(SIGTERM), 0);
    }
    EXPECT_EQ(handler_->End(SIGTERM), 0);
  }

  // The number of acknowledged keyframes of the agent that has the fewest.
  int32_t Acknowledged() const {
    return 1 + std::min(agents_[0]->acknowledged, agents_[1]->acknowledged);
  }
  size_t num_seen() const { return seen_.size(); }
  const std::string& journal() const { return journal_; }

 private:
  // Only for addresses, which must not meet another run's.
  static int Random() { return static_cast<int>(std::random_device()() % 1'000'000); }

  std::string KeyOf(int agent_id) const { return (keys_ / KeyFileName(agent_id)).string(); }
  std::unique_ptr<Program> StartHandler() const {
    return std::make_unique<Program>(
        std::vector<std::string>{bin_ + "pangea-agent-handler", "--link", link_, "--bus", server_,
                                 "--journal", journal_, "--keys", keys_.string()});
  }
  std::unique_ptr<Program> StartUplink(int agent_id) const {
    return std::make_unique<Program>(std::vector<std::string>{
        bin_ + "pangea-uplink", "--agent", std::to_string(agent_id), "--key", KeyOf(agent_id),
        "--bus", agents_[agent_id - 1]->url, "--link", link_});
  }
  void KillDue() {
    if (relay_ && !relay_killed_ && agents_[0]->acknowledged > 90) {
      relay_->End(SIGKILL);
      relay_ = StartRelay(relay_port_);
      relay_killed_ = true;
    }
    if (!handler_killed_ && agents_[0]->acknowledged > 30) {
      handler_->End(SIGKILL);
      handler_ = StartHandler();
      handler_killed_ = true;
    }
    if (!uplink_killed_ && agents_[1]->acknowledged > 60) {
      uplinks_[1]->End(SIGKILL);
      uplinks_[1] = StartUplink(2);
      uplink_killed_ = true;
    }
  }

  const std::string bin_ = std::string(PANGEA_BINARY_DIR) + "/bin/";
  const std::string journal_ = testing::TempDir() + fmt::format("pangea_system_{}.lcm", getpid());
  const std::filesystem::path keys_ =
      testing::TempDir() + fmt::format("pangea_system_{}", getpid());
  const int relay_port_;
  const std::string link_ =
      relay_port_ != 0 ? fmt::format("tcpq://127.0.0.1:{}", relay_port_) : OwnBusUrl();
  const std::string server_ = OwnBusUrl();
  std::unique_ptr<Program> relay_;
  std::unique_ptr<Program> handler_;
  std::vector<std::unique_ptr<Agent>> agents_;
  std::vector<std::unique_ptr<Program>> uplinks_;
  LcmBus server_bus_{server_};
  std::set<std::string> seen_;
  bool handler_killed_ = false, uplink_killed_ = false, relay_killed_ = false;
};

// The number of events on each channel. Expects that keyframes are in order.
std::map<std::string, int32_t> CountInJournal(const std::string& path) {
  std::map<std::string, int32_t> next;
  const Journal read(path, [&](const std::string& channel, Bytes data, const JournalPlace&) {
    if (channel == channels::Options("agent_handler")) {
      ++next[channel];
      return true;
    }
    KeyframeMessage keyframe{};
    EXPECT_TRUE(DecodeMessage(data, &keyframe));
    EXPECT_EQ(keyframe.id.seq, next[channel]++) << channel;
    return true;
  });
  return next;
}

// Over multicast, or through a relay that is killed too.
class LinkSystem : public testing::TestWithParam<bool> {};

TEST_P(LinkSystem, TwoAgentsDeliverThroughKilledProcesses) {
  constexpr int kKeyframes = 150;
  LinkedAgents system(GetParam());
  system.Run(kKeyframes);
  EXPECT_EQ(system.Acknowledged(), kKeyframes);
  system.End();
  const std::map<std::string, int32_t> in_journal = CountInJournal(system.journal());
  const std::map<std::string, int32_t> expected = {
      {"KEYFRAME_1", kKeyframes},
      {"KEYFRAME_2", kKeyframes},
      {"OPTIONS_agent_handler", 1}};  // both starts had the same
  EXPECT_EQ(in_journal, expected);
  // Keyframes journalled but not yet published when the handler was killed are only sent on
  // request.
  EXPECT_GE(system.num_seen(), 2u * kKeyframes - 32);
}

INSTANTIATE_TEST_SUITE_P(Buses, LinkSystem, testing::Bool());

}  // namespace
}  // namespace pangea
