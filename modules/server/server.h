#pragma once

// Runs the server of a site with one command: the eight server processes and, optionally, the
// gateway. A process that ends is restarted; Ctrl-C or SIGTERM ends all in order. Their output goes
// to files. On several hosts: six of the processes and a bridge, once this host has the site; and
// workers.

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "server/bridges.h"

namespace pangea {

struct ServerSetup {
  std::string bus;
  std::string link;
  std::filesystem::path journal;
  std::filesystem::path keys;
  std::filesystem::path logs;
  std::filesystem::path checkpoints;  // folder
  std::string http;                   // ADDRESS:PORT of the anchors' API; empty: none
  std::vector<std::string> origins;   // web origins that may use it
  std::vector<std::string> names;     // host names of this machine that apps may use
  // Port of the gateway for phones' browsers, which needs a site; empty: no gateway.
  std::optional<uint16_t> phone_port;
  std::filesystem::path site;
  std::map<std::string, std::filesystem::path> options;  // options file by process
  std::filesystem::path tags;                            // the site's tags.yaml; empty: none
  int threads = 1;                                       // of each verifier
  ClusterOptions cluster;
};

// Parses "fusion=FILE" into `options`. Throws std::runtime_error with the correction.
void AddProcessOptions(const std::string& text, ServerSetup* options);
// Adds <process>.yaml of each process that has one in the folder; names other files on stdout.
void AddOptionsFolder(const std::filesystem::path& folder, ServerSetup* options);

// The path of a server process' program, in the same directory as this one. Throws
// std::runtime_error.
std::string ProgramOf(const std::string& process);

// Returns the exit code: 0 after a signal, 1 if a process was given up (kept_processes.h), except a
// gateway that has run. Prints on stdout what it starts. Throws std::runtime_error if it cannot
// start.
int Serve(const ServerSetup& options);
// Runs the verifiers and a bridge for another host's server; uses only bus, logs, options and
// cluster. Exit code and exceptions as above.
int ServeAsWorker(const ServerSetup& options);

}  // namespace pangea
