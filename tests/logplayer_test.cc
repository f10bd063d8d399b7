// Tests that a capture's inputs, played by lcm-logplayer to server processes started by hand, give
// the same map as the capture's replay.

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "programs.h"

namespace pangea::tests {
namespace {

namespace fs = std::filesystem;

constexpr int kTries = 60;  // one per second, until the processes have finished their work

std::string LoopbackUrl() {
  // Below the range from which the kernel gives ports to LCM's senders.
  return "udpm://239.255.76.67:" + std::to_string(20000 + getpid() % 12000) +
         "?ttl=0&recv_buf_size=4194304";
}

// The server processes and a logger, until the object is destroyed.
class ServerByHand {
 public:
  ServerByHand(const std::string& url, const fs::path& folder) {
    const fs::path pids = folder / "pids";
    std::string command;
    for (const char* name :
         {"place-recognition", "inter-map-ba", "fusion", "posegraph", "global-ba"}) {
      command += std::string("pangea-") + name + " --bus '" + url + "' >" +
                 (folder / name).string() + " 2>&1 & echo $! >>" + pids.string() + "; ";
    }
    command += "lcm-logger --quiet --lcm-url='" + url + "' " + (folder / "bus.lcm").string() +
               " >/dev/null 2>&1 & echo $! >>" + pids.string() + "; sleep 1";
    RunCommand(command);
    pids_ = ReadFile(pids);
    std::replace(pids_.begin(), pids_.end(), '\n', ' ');
  }
  ~ServerByHand() { RunCommand("kill " + pids_); }
  ServerByHand(const ServerByHand&) = delete;
  ServerByHand& operator=(const ServerByHand&) = delete;

 private:
  std::string pids_;
};

TEST(LogPlayer, FeedsLiveProcesses) {
  const fs::path sample = fs::path(PANGEA_SOURCE_DIR) / "logs" / "two_walks";
  const fs::path folder = FreshFolder("logplayer");
  const std::string url = LoopbackUrl();
  const ServerByHand server(url, folder);
  const Outcome played =
      RunCommand("lcm-logplayer --speed=5 --lcm-url='" + url + "' --regexp='KEYFRAME_.*' " +
                 (sample / "session.lcm").string());
  ASSERT_EQ(played.exit_code, 0) << played.output;

  double distance_1 = 0;
  double distance_2 = 0;
  std::string said;
  for (int i = 0; i < kTries; ++i) {
    std::this_thread::sleep_for(std::chrono::seconds(1));
    said = RunCommand("pangea-session report " + (folder / "bus.lcm").string() + " --out " +
                      (folder / "report").string())
               .output;
    distance_1 = Distance_m(folder / "report/agent_1.tum", sample / "expected/agent_1.tum");
    distance_2 = Distance_m(folder / "report/agent_2.tum", sample / "expected/agent_2.tum");
    if (distance_1 < kTolerance_m && distance_2 < kTolerance_m) {
      break;
    }
  }
  EXPECT_LT(distance_1, kTolerance_m) << said;
  EXPECT_LT(distance_2, kTolerance_m) << said;
  const auto report = ReadJson(folder / "report/report.json");
  ASSERT_EQ(report["groups"].size(), 1u) << said;
  EXPECT_EQ(report["groups"][0]["agents"], nlohmann::json({1, 2}));
  fs::remove_all(folder);
}

}  // namespace
}  // namespace pangea::tests
