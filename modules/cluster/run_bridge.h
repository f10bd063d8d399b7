#pragma once

// Runs pangea-bridge in one of its roles.

#include <filesystem>
#include <string>

#include "bus/bus.h"
#include "cluster/nats/nats_access.h"

namespace pangea {

struct BridgeArguments {
  std::string role;  // core, worker, standby, edge or link
  std::string site;
  std::string bus;  // empty: the default of the server bus, or of the link bus
  NatsAccess nats;
  int replicas = 0;               // of the streams; 0: keep the number
  size_t max_matches = 4;         // that a worker takes at a time
  std::filesystem::path journal;  // of a standby
  std::string holder;             // of the lease; empty: a random name; a core waits for the lease
};

// Runs until a signal; a standby also ends when this host has become the site's core, and a core
// when another host has. Returns the exit code, 0 in these cases. Throws std::runtime_error.
int RunBridge(BridgeArguments arguments);

}  // namespace pangea
