// The real programs over UDP multicast on loopback: two agents, the handler killed in between.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <random>
#include <set>
#include <thread>

#include "agent_handler/journal.h"
#include "agent_handler/test_keyframes.h"
#include "common/bus/process.h"
#include "common/channels.h"
#include "pangea/have_t.hpp"

namespace pangea {
namespace {

using Clock = std::chrono::steady_clock;

class Program {
 public:
  explicit Program(std::vector<std::string> args) {
    pid_ = fork();
    if (pid_ == 0) {
      std::vector<char*> argv;
      for (std::string& arg : args) {
        argv.push_back(arg.data());
      }
      argv.push_back(nullptr);
      execv(argv[0], argv.data());
      _exit(127);
    }
  }
  ~Program() { End(SIGTERM); }
  int End(int signal) {
    if (pid_ <= 0) {
      return 0;
    }
    kill(pid_, signal);
    int status = 0;
    waitpid(pid_, &status, 0);
    pid_ = -1;
    return status;
  }

 private:
  pid_t pid_ = -1;
};

// A multicast group and port of its own for each bus of this run.
std::string RandomUrl(std::random_device& device) {
  return fmt::format("udpm://239.{}.{}.{}:{}?ttl=0&recv_buf_size=4194304", 192 + device() % 60,
                     device() % 256, 1 + device() % 250, 20000 + device() % 30000);
}

struct Agent {
  Agent(int32_t agent_id, const std::string& url) : id(agent_id), map{id, 1000}, bus(url) {
    bus.Subscribe("HAVE", [this](const std::string&, Bytes data) {
      have_t have{};
      if (DecodeMessage(data, &have) && have.num_maps == 1) {
        acknowledged = have.highest_seq[0];
      }
    });
  }
  void Publish() { bus.Publish(channels::Keyframe(id), EncodeTestKeyframe({map, published++})); }
  int32_t id;
  MapId map;
  LcmBus bus;
  int32_t published = 0;
  int32_t acknowledged = -1;
};

TEST(LinkSystem, TwoAgentsDeliverThroughAKilledHandler) {
  constexpr int kKeyframes = 100;
  std::random_device device;  // only for the addresses, which must not meet another run's
  const std::string link = RandomUrl(device), server = RandomUrl(device);
  const std::string agent_urls[] = {RandomUrl(device), RandomUrl(device)};
  const std::string journal = testing::TempDir() + fmt::format("pangea_system_{}.lcm", getpid());
  std::filesystem::remove(journal);
  const std::string bin = std::string(PANGEA_BINARY_DIR) + "/bin/";

  const auto start_handler = [&] {
    return std::make_unique<Program>(std::vector<std::string>{
        bin + "pangea-agent-handler", "--link", link, "--server", server, "--journal", journal});
  };
  auto handler = start_handler();
  std::vector<std::unique_ptr<Program>> uplinks;
  std::vector<std::unique_ptr<Agent>> agents;
  for (int i = 0; i < 2; ++i) {
    agents.push_back(std::make_unique<Agent>(i + 1, agent_urls[i]));
    uplinks.push_back(std::make_unique<Program>(
        std::vector<std::string>{bin + "pangea-uplink", "--agent", std::to_string(i + 1), "--bus",
                                 agent_urls[i], "--link", link}));
  }
  LcmBus server_bus(server);
  std::set<std::string> seen;
  server_bus.Subscribe("(KEYFRAME_1|KEYFRAME_2)", [&](const std::string&, Bytes data) {
    seen.emplace(data.begin(), data.end());
  });
  // Both uplinks have to be listening before the first keyframe: there is no odometry to ask here.
  std::this_thread::sleep_for(std::chrono::milliseconds(500));

  bool killed = false;
  const auto begin = Clock::now();
  const auto deadline = begin + std::chrono::seconds(12);
  auto next_publish = begin;
  const auto done = [&] {
    return agents[0]->acknowledged == kKeyframes - 1 && agents[1]->acknowledged == kKeyframes - 1;
  };
  while (!done() && Clock::now() < deadline) {
    if (Clock::now() >= next_publish) {
      next_publish += std::chrono::milliseconds(30);  // 2 x 33 keyframes/s
      for (auto& agent : agents) {
        if (agent->published < kKeyframes) {
          agent->Publish();
        }
      }
    }
    server_bus.Handle(1);
    for (auto& agent : agents) {
      while (agent->bus.Handle(0)) {
      }
    }
    if (!killed && agents[0]->acknowledged > 30) {
      handler->End(SIGKILL);
      handler = start_handler();
      killed = true;
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
    keyframe_t keyframe{};
    EXPECT_TRUE(DecodeMessage(data, &keyframe));
    EXPECT_EQ(keyframe.id.seq, next[channel]++) << channel;
    return true;
  });
  EXPECT_EQ(next["KEYFRAME_1"], kKeyframes);
  EXPECT_EQ(next["KEYFRAME_2"], kKeyframes);
  // Only what was journalled but not yet published when the handler was killed is served, not seen.
  EXPECT_GE(seen.size(), 2u * kKeyframes - 10);
  std::filesystem::remove(journal);
}

}  // namespace
}  // namespace pangea
