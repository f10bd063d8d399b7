#include "session/run/session_processes.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <stdexcept>
#include <utility>
#include <vector>

#include "files/make_folder.h"
#include "files/text_file.h"
#include "link/agent_key.h"
#include "server/server_processes.h"

namespace pangea::session {

namespace fs = std::filesystem;

SessionProcesses::SessionProcesses(fs::path folder, Buses buses)
    : folder_(std::move(folder)), buses_(std::move(buses)), kept_(folder_ / "logs") {}

fs::path SessionProcesses::KeyFile(int32_t agent_id) const {
  return folder_ / "keys" / KeyFileName(agent_id);
}

void SessionProcesses::MakeKeys(const SessionScript& script) const {
  fs::remove_all(folder_ / "keys");
  MakeFolder(folder_ / "keys");
  for (const AgentScript& agent : script.agents) {
    MakeKeyFile(KeyFile(agent.id), agent.id);
  }
}

std::string SessionProcesses::WriteOptionsText(const std::string& process,
                                               const std::string& yaml) const {
  const fs::path file = folder_ / "logs" / (process + ".yaml");
  WriteTextFile(file, yaml);
  return file.string();
}

// lcm-logger refuses an existing file; a restarted one must continue it: append.
void SessionProcesses::StartLogger(const std::string& name, const std::string& url,
                                   const fs::path& file) {
  const auto logger = FindOnPath("lcm-logger");
  if (!logger) {
    throw std::runtime_error("lcm-logger is not on PATH: install liblcm-bin");
  }
  kept_.Start(name, {logger->string(), "--append", "--lcm-url=" + url, file.string()});
}

void SessionProcesses::StartServer(const SessionServerOptions& options, const fs::path& journal) {
  StartLogger("logger_server", buses_.server, folder_ / "session.lcm");
  kept_.Start("agent_handler",
              {SiblingProgram("pangea-agent-handler"), "--link", buses_.link, "--bus",
               buses_.server, "--journal", journal.string(), "--keys", (folder_ / "keys").string(),
               "--options", WriteOptions("agent_handler", options.agent_handler)});
  const std::map<std::string, std::string> texts = TextsByProcess(options);
  for (const std::string name : kServerProcesses) {
    if (name == "agent_handler") {
      continue;
    }
    std::string program = "pangea-" + name;
    std::ranges::replace(program, '_', '-');
    std::vector<std::string> argv{SiblingProgram(program), "--bus", buses_.server};
    if (const auto text = texts.find(name); text != texts.end()) {
      argv.insert(argv.end(), {"--options", WriteOptionsText(name, text->second)});
    }
    kept_.Start(name, argv);
  }
}

void SessionProcesses::StartUplink(const AgentScript& agent) {
  const std::string bus = buses_.agents.at(agent.id);
  StartLogger(fmt::format("logger_agent_{}", agent.id), bus,
              folder_ / fmt::format("agent_{}.lcm", agent.id));
  if (agent.link) {
    StartLinkEmulator(agent);
  }
  const std::string name = fmt::format("uplink_{}", agent.id);
  kept_.Start(name, {SiblingProgram("pangea-uplink"), "--agent", std::to_string(agent.id), "--key",
                     KeyFile(agent.id).string(), "--bus", bus, "--link", buses_.LinkOf(agent.id),
                     "--spool", (folder_ / fmt::format("spool_{}", agent.id)).string(), "--options",
                     WriteOptions(name, agent.uplink)});
}

void SessionProcesses::StartLinkEmulator(const AgentScript& agent) {
  const std::string name = fmt::format("link_emulator_{}", agent.id);
  kept_.Start(name, {SiblingProgram("pangea-link-emulator"), "--agent", std::to_string(agent.id),
                     "--agent-link", buses_.LinkOf(agent.id), "--server-link", buses_.link, "--bus",
                     buses_.agents.at(agent.id), "--options", WriteOptions(name, *agent.link)});
}

}  // namespace pangea::session
