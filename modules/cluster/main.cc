// pangea-bridge: a site's verification work on more than one host, over NATS.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>

#include "bus/process.h"
#include "bus/retransmission/journal_first.h"
#include "bus/status_log.h"
#include "cluster/core_bridge.h"
#include "cluster/worker_bridge.h"

// core:   KEYFRAME_*, PLACE_MATCH --> CoreBridge   --> streams of NATS --> CONSTRAINT
// worker: streams of NATS         --> WorkerBridge --> KEYFRAME_*, PLACE_MATCH; CONSTRAINT back
int main(int argc, char** argv) {
  CLI::App app("Shares a server's verification with other hosts, over NATS", "pangea-bridge");
  std::string bus_url = pangea::kDefaultBusUrl, nats_url = "nats://127.0.0.1:4222", site, role;
  size_t max_matches = 4;
  app.add_option("--bus", bus_url, "LCM URL: core: of the server bus; worker: of a bus of its own")
      ->capture_default_str();
  app.add_option("--nats", nats_url, "URL of nats-server, with JetStream")->capture_default_str();
  app.add_option("--site", site, "name of the site: core and workers of one name work together")
      ->required();
  app.add_option("--role", role, "core: beside the server; worker: beside fusion and inter_map_ba")
      ->required()
      ->check(CLI::IsMember({"core", "worker"}));
  app.add_option("--matches", max_matches, "a worker's matches at a time")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    pangea::LcmBus bus(bus_url);
    pangea::SiteStreams streams(nats_url, site);
    pangea::StartLog("pangea-bridge",
                     fmt::format("{} of site {}, bus {}, NATS {}", role, site, bus_url, nats_url));
    if (role == "worker") {
      pangea::WorkerBridge worker(bus, streams, max_matches);
      return pangea::RunProcess(bus, worker);
    }
    pangea::JournalFirstBus journal_first(bus, pangea::WallUtime());
    pangea::CoreBridge core(journal_first, streams);
    return pangea::RunProcess(bus, core, &journal_first);
  } catch (const std::exception& error) {
    std::cerr << fmt::format("pangea-bridge: {}\n", error.what());
    return 1;
  }
}
