#include "server/bridges.h"

#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <random>
#include <stdexcept>
#include <thread>

#include "bus/process.h"
#include "bus/wall_clock.h"
#include "processes/child_process.h"
#include "server/server.h"

namespace pangea {
namespace {

constexpr std::chrono::milliseconds kStandbyLook{50};
constexpr double kStandbyStopGrace_s = 5;

const char* NameOf(BridgeRole role) {
  switch (role) {
    case BridgeRole::kCore:
      return "core";
    case BridgeRole::kStandby:
      return "standby";
    case BridgeRole::kLink:
      return "link";
    default:
      return "worker";
  }
}

}  // namespace

std::string DrawHolder() {
  std::array<char, 64> host{};
  gethostname(host.data(), host.size() - 1);
  return fmt::format("{}:{}:{:08x}", host.data(), getpid(), std::random_device{}());
}

std::vector<std::string> BridgeCommand(BridgeRole role, const ClusterOptions& options,
                                       const std::string& bus,
                                       const std::filesystem::path& journal) {
  std::vector<std::string> argv{ProgramOf("bridge"), "--role", NameOf(role), "--site",
                                options.site,        "--nats", options.nats};
  const auto add = [&argv](const char* option, const std::string& value) {
    if (!value.empty()) {
      argv.insert(argv.end(), {option, value});
    }
  };
  add("--ca", options.ca.string());
  add("--credentials", options.credentials.string());
  if (role == BridgeRole::kWorker) {
    add("--matches", std::to_string(options.max_matches));
  } else if (role != BridgeRole::kLink) {
    add("--holder", options.holder);
    add("--replicas", options.replicas > 0 ? std::to_string(options.replicas) : "");
  }
  add("--journal", journal.string());
  add("--bus", role == BridgeRole::kStandby ? "" : bus);
  return argv;
}

bool StandBy(const ClusterOptions& options, const std::filesystem::path& journal,
             const std::filesystem::path& logs, Checkpoints* checkpoints) {
  ChildProcess standby("bridge", BridgeCommand(BridgeRole::kStandby, options, "", journal),
                       logs / "bridge.txt");
  while (!StopRequested()) {
    if (const auto exit = standby.Poll()) {
      if (exit->code != 0) {
        throw std::runtime_error(standby.LastLine());
      }
      return true;
    }
    checkpoints->Tick(SteadySeconds());
    std::this_thread::sleep_for(kStandbyLook);
  }
  standby.Stop(kStandbyStopGrace_s);
  return false;
}

}  // namespace pangea
