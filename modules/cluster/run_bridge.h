#pragma once

// pangea-bridge in each of its roles.

#include <filesystem>
#include <string>

#include "bus/bus.h"
#include "cluster/nats_access.h"

namespace pangea {

struct BridgeArguments {
  std::string role;  // core, worker or standby
  std::string site;
  std::string bus = kDefaultBusUrl;
  NatsAccess nats;
  int replicas = 0;               // of the streams; 0: as they are
  size_t max_matches = 4;         // a worker's at a time
  std::filesystem::path journal;  // a standby's
  std::string holder;             // of the lease; empty: a name is drawn, and a core waits for it
};

// Until a signal, and of a standby until this host is the site's core. The exit code. Throws
// std::runtime_error.
int RunBridge(BridgeArguments arguments);

}  // namespace pangea
