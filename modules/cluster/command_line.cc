#include "cluster/command_line.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "bus/bus.h"
#include "cluster/run_bridge.h"
#include "link/wire.h"
#include "options/command_line.h"

namespace pangea::cluster {

int RunCommandLine(int argc, char** argv) {
  CLI::App app("Shares a site between hosts, over NATS", "pangea-bridge");
  AddVersion(app);
  BridgeArguments arguments;
  app.add_option("--role", arguments.role,
                 "core: beside the server; worker: beside fusion and inter_map_ba; standby: until "
                 "this host may be the core; edge: for agents on another network than the server; "
                 "link: the edges' other end, on the server's link bus")
      ->required()
      ->check(CLI::IsMember({"core", "worker", "standby", "edge", "link"}));
  app.add_option("--site", arguments.site, "name of the site: bridges of one name work together")
      ->required();
  app.add_option(
      "--bus", arguments.bus,
      fmt::format("LCM URL: core: of the server bus; worker: of a bus of its own (default: "
                  "{}); edge, link: of the link bus (default: {})",
                  kDefaultBusUrl, kDefaultLinkUrl));
  app.add_option("--nats", arguments.nats.url,
                 "URL of nats-server, with JetStream; of a cluster several, with commas between")
      ->capture_default_str();
  app.add_option("--ca", arguments.nats.ca,
                 "of tls://: certificate of the authority of nats-server");
  app.add_option("--credentials", arguments.nats.credentials,
                 "file with user and password (pangea-nats-config), mode 0600");
  app.add_option(
         "--replicas", arguments.replicas,
         "core, standby: nodes of NATS that have each message (default: as the streams are)")
      ->check(CLI::Range(1, 5));
  app.add_option("--matches", arguments.max_matches, "a worker's matches at a time")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app.add_option("--journal", arguments.journal,
                 "standby: LCM log that follows the site's journal");
  app.add_option("--holder", arguments.holder,
                 "core, standby: name under which this host has the site (default: drawn)");
  CLI11_PARSE(app, argc, argv);
  try {
    return RunBridge(arguments);
  } catch (const std::exception& error) {
    return Failed("pangea-bridge", error);
  }
}

}  // namespace pangea::cluster
