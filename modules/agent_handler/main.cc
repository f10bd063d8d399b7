// pangea-agent-handler: connects the link bus and the server bus, and owns the journal. It also
// makes the agents' keys.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>

#include "agent_handler/agent_handler_process.h"
#include "agent_handler/keygen.h"
#include "bus/bus_url.h"
#include "bus/status_log.h"
#include "options/command_line.h"
#include "options/options_arguments.h"

int main(int argc, char** argv) {
  CLI::App app("Takes keyframes of all agents, journals and acknowledges them",
               "pangea-agent-handler");
  std::string link = pangea::kDefaultLinkUrl;
  std::string server = pangea::kDefaultBusUrl;
  std::string journal;
  std::string keys;
  std::string checkpoints;
  pangea::AgentHandlerOptions options;
  app.add_option("--link", link, "LCM URL of the link bus")->capture_default_str();
  app.add_option("--bus,--server", server, "LCM URL of the server bus")->capture_default_str();
  app.add_option("--journal", journal, "LCM log to append to; an existing one is loaded");
  app.add_option("--keys", keys, "folder with the key of each agent that may join");
  app.add_option("--checkpoints", checkpoints,
                 "folder of the other processes' checkpoints; removed when the journal is damaged, "
                 "as they have what it lost");
  app.add_flag("--replicated", options.replicated,
               "acknowledges only what pangea-bridge says to be in NATS too");
  pangea::OptionsArguments options_arguments(app);
  pangea::KeygenArguments keygen_arguments;
  const CLI::App* keygen = pangea::AddKeygen(app, &keygen_arguments);
  CLI11_PARSE(app, argc, argv);
  try {
    if (keygen->parsed()) {
      return pangea::Keygen(keygen_arguments);
    }
    pangea::YamlOptions yaml;
    options.Visit(yaml);
    options_arguments.Read(&yaml);
    if (options_arguments.Printed(yaml)) {
      return 0;
    }
    if (journal.empty() || keys.empty()) {
      throw std::runtime_error("give --journal FILE and --keys FOLDER (or: keygen --agent ID)");
    }
    pangea::RequireTwoBuses("--link", link, "--bus", server);
    pangea::LcmBus link_bus(link, pangea::LcmBus::Fragments::kRefused);
    pangea::LcmBus server_bus(server);
    const auto remove_checkpoints = [&checkpoints] {
      if (!checkpoints.empty()) {
        std::filesystem::remove_all(checkpoints);
      }
    };
    pangea::AgentHandlerProcess process(link_bus, server_bus, journal, keys, pangea::WallUtime(),
                                        options, remove_checkpoints);
    pangea::StartLog("pangea-agent-handler",
                     fmt::format("bus {}, link {}, journal {}, keys {}, {}", server, link, journal,
                                 keys, options_arguments.Source()));
    pangea::OptionsAnnouncer announcer(server_bus, "agent_handler", yaml.PrintWithoutHelp());
    return pangea::RunPolledProcess(link_bus, server_bus, process, announcer);
  } catch (const std::exception& error) {
    return pangea::Failed("pangea-agent-handler", error);
  }
}
