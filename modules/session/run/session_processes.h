#pragma once

// Starts the processes of a session that are started again when they end: the server's, each
// agent's uplink and link emulator, and a logger of each bus.

#include <filesystem>
#include <string>

#include "options/yaml_options.h"
#include "processes/kept_processes.h"
#include "session/processes/buses.h"
#include "session/session_file/session_file.h"

namespace pangea::session {

class SessionProcesses {
 public:
  // `folder`: of everything that the session leaves; its folder logs must exist.
  SessionProcesses(std::filesystem::path folder, Buses buses);

  // Makes keys that only this session's processes know.
  void MakeKeys(const SessionScript& script) const;
  void StartServer(const SessionServerOptions& options, const std::filesystem::path& journal);
  void StartUplink(const AgentScript& agent);
  // Writes the options file of a process; returns its path.
  template <typename Options>
  std::string WriteOptions(const std::string& process, Options options) const {
    YamlOptions yaml;
    options.Visit(yaml);
    return WriteOptionsText(process, yaml.Print());
  }

  KeptProcesses& kept() { return kept_; }
  const KeptProcesses& kept() const { return kept_; }

 private:
  std::string WriteOptionsText(const std::string& process, const std::string& yaml) const;
  std::filesystem::path KeyFile(int32_t agent_id) const;
  void StartLogger(const std::string& name, const std::string& url,
                   const std::filesystem::path& file);
  void StartLinkEmulator(const AgentScript& agent);

  const std::filesystem::path folder_;
  const Buses buses_;
  KeptProcesses kept_;
};

}  // namespace pangea::session
