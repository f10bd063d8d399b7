#include "cluster/run_bridge.h"

#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <functional>
#include <random>
#include <stdexcept>
#include <thread>

#include "bus/process.h"
#include "bus/status_log.h"
#include "cluster/core_bridge.h"
#include "cluster/link_bridge.h"
#include "cluster/standby.h"
#include "cluster/worker_bridge.h"
#include "journal_follower/journal_first.h"
#include "link/wire.h"

namespace pangea {
namespace {

constexpr char kProgram[] = "pangea-bridge";
constexpr std::chrono::milliseconds kStep{100};

std::string DrawnHolder() {
  std::array<char, 64> host{};
  gethostname(host.data(), host.size() - 1);
  return fmt::format("{}:{:08x}", host.data(), std::random_device{}());
}

// Waits until `holds` is true or a signal comes; returns whether it is true. Logs `said` when it
// changes.
bool Wait(const std::function<bool()>& holds, const std::function<std::string()>& said) {
  InstallSignalHandlers();
  StateChanges changes;
  while (!StopRequested()) {
    if (holds()) {
      return true;
    }
    if (const auto line = changes.Take(WallUtime(), said())) {
      Log(kProgram, *line);
    }
    std::this_thread::sleep_for(kStep);
  }
  return false;
}

int RunStandby(const BridgeArguments& arguments, SiteStreams& streams) {
  if (arguments.journal.empty()) {
    throw std::runtime_error("give --journal FILE, which follows the site's");
  }
  streams.Make(arguments.replicas);
  Standby standby(arguments.journal, streams, arguments.holder);
  const bool is_core =
      Wait([&] { return standby.Step(WallUtime()); }, [&] { return standby.Said(); });
  Log(kProgram, standby.Said());
  return is_core ? 0 : 1;
}

// A thread of its own, because the bridge's waits for streams that have no leader.
std::jthread GiveSigns(SiteStreams& streams, const std::string& holder) {
  return std::jthread([&streams, holder](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      streams.PublishSign(holder);
      std::this_thread::sleep_for(std::chrono::microseconds(SiteLease::kSign_us));
    }
  });
}

int RunAsHolder(const BridgeArguments& arguments, SiteStreams& streams, SiteLease& lease) {
  const std::jthread signs = GiveSigns(streams, arguments.holder);
  LcmBus bus(arguments.bus);
  JournalFirstBus journal_first(bus, WallUtime());
  CoreBridge core(journal_first, streams, lease);
  const int code = RunProcess(bus, core, [&](int64_t now) { journal_first.Poll(now); });
  lease.Release();
  return code;
}

// `waits`: for the lease, while another host has it. Otherwise a standby of this host took it, and
// has made the streams; this bridge only waits while NATS does not answer.
int RunCore(const BridgeArguments& arguments, SiteStreams& streams, bool waits) {
  if (waits) {
    streams.Make(arguments.replicas);
  }
  SiteLease lease(streams, arguments.holder);
  const auto decided = [&] {
    return lease.TryAcquire(WallUtime()) || (!waits && lease.is_anothers());
  };
  if (!Wait(decided, [&] { return fmt::format("waits for the site: {}", lease.seen_holder()); })) {
    return 0;
  }
  if (lease.is_anothers()) {
    Log(kProgram, fmt::format("another core has the site: {}", lease.seen_holder()));
    return 0;
  }
  try {
    return RunAsHolder(arguments, streams, lease);
  } catch (const LeaseLost& lost) {
    Log(kProgram, lost.what());
    return 0;
  }
}

int RunWorker(const BridgeArguments& arguments, SiteStreams& streams) {
  if (!Wait([&] { return streams.AreThere(); },
            [] { return std::string("waits for the site's server"); })) {
    return 0;
  }
  LcmBus bus(arguments.bus);
  WorkerBridge worker(bus, streams, arguments.max_matches);
  return RunProcess(bus, worker);
}

// Needs no streams, so an edge may have a user without rights for them.
int RunLink(const BridgeArguments& arguments, LinkBridge::End end) {
  NatsClient nats(arguments.nats, fmt::format("pangea-bridge {}", arguments.role));
  LcmBus bus(arguments.bus, LcmBus::Fragments::kRefused);
  LinkBridge link(bus, nats, arguments.site, end);
  return RunProcess(bus, link);
}

}  // namespace

int RunBridge(BridgeArguments arguments) {
  const bool edge = arguments.role == "edge", carries_link = edge || arguments.role == "link";
  if (arguments.bus.empty()) {
    arguments.bus = carries_link ? kDefaultLinkUrl : kDefaultBusUrl;
  }
  StartLog(kProgram, fmt::format("{} of site {}, bus {}, NATS {}", arguments.role, arguments.site,
                                 arguments.bus, arguments.nats.url));
  if (carries_link) {
    return RunLink(arguments, edge ? LinkBridge::End::kEdge : LinkBridge::End::kServer);
  }
  SiteStreams streams(arguments.nats, arguments.site);
  const bool drawn = arguments.holder.empty();
  arguments.holder = drawn ? DrawnHolder() : arguments.holder;
  if (arguments.role == "standby") {
    return RunStandby(arguments, streams);
  }
  return arguments.role == "core" ? RunCore(arguments, streams, drawn)
                                  : RunWorker(arguments, streams);
}

}  // namespace pangea
