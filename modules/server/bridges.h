#pragma once

// For a server on several hosts: the command of its bridge to NATS, and waiting until this host may
// serve the site (cluster.md).

#include <filesystem>
#include <string>
#include <vector>

#include "server/checkpoints.h"

namespace pangea {

struct ClusterOptions {
  std::string nats;  // URL; empty: this host serves alone
  std::filesystem::path ca;
  std::filesystem::path credentials;
  int replicas = 0;        // of the streams; 0: unchanged
  std::string site;        // name of the site in NATS
  std::string holder;      // holder of the lease
  size_t max_matches = 4;  // of a worker, at a time
  bool edges = false;      // agents may come over edges
};

// A unique name.
std::string DrawHolder();

enum class BridgeRole { kCore, kStandby, kWorker, kLink };
// `journal`: only for kStandby.
std::vector<std::string> BridgeCommand(BridgeRole role, const ClusterOptions& options,
                                       const std::string& bus,
                                       const std::filesystem::path& journal = {});

// Runs the standby until this host gets the site (true) or a signal comes (false). Meanwhile
// checkpoints of its journal are written. Throws std::runtime_error if the standby cannot continue.
bool StandBy(const ClusterOptions& options, const std::filesystem::path& journal,
             const std::filesystem::path& logs, Checkpoints* checkpoints);

}  // namespace pangea
