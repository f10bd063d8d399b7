#pragma once

// The server of a site by one command: the eight server processes and, if wanted, the gateway, each
// started again when it ends, until Ctrl-C or SIGTERM ends them in order (what they say goes to
// files).

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>

namespace pangea::session {

struct ServerOptions {
  std::string bus;
  std::string link;
  std::filesystem::path journal;
  std::filesystem::path keys;
  std::filesystem::path logs;
  std::filesystem::path checkpoints;  // folder
  std::string http;                   // ADDRESS:PORT of the anchors' API; empty: none
  // Of the gateway for phones' browsers, which needs a site; nothing: none. The server runs without
  // it when it cannot start.
  std::optional<uint16_t> phone_port;
  std::filesystem::path site;
  std::map<std::string, std::filesystem::path> options;  // of each process, its file
  std::set<std::string> without;  // processes that are not started: others do their part
};

// "fusion=FILE" into `options`. Throws std::runtime_error naming the mend.
void AddProcessOptions(const std::string& text, ServerOptions* options);
// Throws std::runtime_error when it is no process of the server's.
void LeaveOut(const std::string& process, ServerOptions* options);
// <process>.yaml of each process that has one there.
void AddOptionsFolder(const std::filesystem::path& folder, ServerOptions* options);

// Returns the exit code: 0 after a signal, 1 when a process was given up (kept_processes.h). Tells
// on stdout what it starts. Throws std::runtime_error when it cannot begin.
int Serve(const ServerOptions& options);

}  // namespace pangea::session
