#pragma once

// A server of several hosts: the command of its bridge to NATS, and waiting until this host may
// serve the site (cluster.md).

#include <filesystem>
#include <string>
#include <vector>

#include "session/server/checkpoints.h"

namespace pangea::session {

struct ClusterOptions {
  std::string nats;  // URL; empty: this host serves alone
  std::filesystem::path ca;
  std::filesystem::path credentials;
  int replicas = 0;        // of the streams; 0: as they are
  std::string site;        // its name there
  std::string holder;      // of the lease
  size_t max_matches = 4;  // a worker's at a time
};

// A name that nobody else has.
std::string DrawHolder();

enum class BridgeRole { kCore, kStandby, kWorker };
// `journal`: a standby's.
std::vector<std::string> BridgeCommand(BridgeRole role, const ClusterOptions& options,
                                       const std::string& bus,
                                       const std::filesystem::path& journal = {});

// Runs the standby until this host has the site (true), or a signal comes. Meanwhile the
// checkpoints follow its journal. Throws std::runtime_error when the standby cannot go on.
bool StandBy(const ClusterOptions& options, const std::filesystem::path& journal,
             const std::filesystem::path& logs, Checkpoints* checkpoints);

}  // namespace pangea::session
