#pragma once

// The server of a site by one command: the eight server processes and, if wanted, the gateway, each
// started again when it ends, until Ctrl-C or SIGTERM ends them in order (what they say goes to
// files). On several hosts: six of them and a bridge, once this host has the site; and a worker.

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "session/server/bridges.h"

namespace pangea::session {

struct ServerOptions {
  std::string bus;
  std::string link;
  std::filesystem::path journal;
  std::filesystem::path keys;
  std::filesystem::path logs;
  std::filesystem::path checkpoints;  // folder
  std::string http;                   // ADDRESS:PORT of the anchors' API; empty: none
  std::vector<std::string> origins;   // whose pages may use it
  std::vector<std::string> names;     // of this machine, by which apps may ask it
  // Of the gateway for phones' browsers, which needs a site; nothing: none. The server runs without
  // it when it cannot start.
  std::optional<uint16_t> phone_port;
  std::filesystem::path site;
  std::map<std::string, std::filesystem::path> options;  // of each process, its file
  ClusterOptions cluster;
};

// "fusion=FILE" into `options`. Throws std::runtime_error naming the mend.
void AddProcessOptions(const std::string& text, ServerOptions* options);
// <process>.yaml of each process that has one there.
void AddOptionsFolder(const std::filesystem::path& folder, ServerOptions* options);

// The path of a server process' program, which belongs beside this one; throws std::runtime_error.
std::string ProgramOf(const std::string& process);
double SteadySeconds();

// Returns the exit code: 0 after a signal, 1 when a process was given up (kept_processes.h). Tells
// on stdout what it starts. Throws std::runtime_error when it cannot begin.
int Serve(const ServerOptions& options);
// The verifiers and a bridge for another host's server: bus, logs, options, cluster. The same.
int ServeAsWorker(const ServerOptions& options);

}  // namespace pangea::session
