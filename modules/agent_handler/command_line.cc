#include "agent_handler/command_line.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>

#include "agent_handler/agent_handler_process.h"
#include "agent_handler/keygen.h"
#include "bus/bus_url.h"
#include "bus/status_log.h"
#include "options/command_line.h"
#include "options/options_arguments.h"

namespace pangea::agent_handler {
namespace {

struct Arguments {
  std::string link = kDefaultLinkUrl;
  std::string server = kDefaultBusUrl;
  std::string journal, keys, checkpoints;
};

void AddArguments(CLI::App& app, Arguments& a, AgentHandlerOptions& options) {
  app.add_option("--link", a.link, "LCM URL of the link bus")->capture_default_str();
  app.add_option("--bus,--server", a.server, "LCM URL of the server bus")->capture_default_str();
  app.add_option("--journal", a.journal, "LCM log to append to; an existing one is loaded");
  app.add_option("--keys", a.keys, "folder with the key of each agent that may join");
  app.add_option("--checkpoints", a.checkpoints,
                 "folder of the other processes' checkpoints; removed when the journal is damaged, "
                 "as they have what it lost");
  app.add_flag("--replicated", options.replicated,
               "acknowledges only what pangea-bridge says to be in NATS too");
}

int Run(const Arguments& a, const AgentHandlerOptions& options, const std::string& options_source,
        const std::string& told_options) {
  if (a.journal.empty() || a.keys.empty()) {
    throw std::runtime_error("give --journal FILE and --keys FOLDER (or: keygen --agent ID)");
  }
  RequireTwoBuses("--link", a.link, "--bus", a.server);
  LcmBus link_bus(a.link, LcmBus::Fragments::kRefused);
  LcmBus server_bus(a.server);
  const auto remove_checkpoints = [&a] {
    if (!a.checkpoints.empty()) {
      std::filesystem::remove_all(a.checkpoints);
    }
  };
  AgentHandlerProcess process(link_bus, server_bus, a.journal, a.keys, WallUtime(), options,
                              remove_checkpoints);
  StartLog("pangea-agent-handler", fmt::format("bus {}, link {}, journal {}, keys {}, {}", a.server,
                                               a.link, a.journal, a.keys, options_source));
  OptionsAnnouncer announcer(server_bus, "agent_handler", told_options);
  return RunPolledProcess(link_bus, server_bus, process, announcer);
}

}  // namespace

int RunCommandLine(int argc, char** argv) {
  CLI::App app("Takes keyframes of all agents, journals and acknowledges them",
               "pangea-agent-handler");
  AddVersion(app);
  Arguments arguments;
  AgentHandlerOptions options;
  AddArguments(app, arguments, options);
  OptionsArguments options_arguments(app);
  KeygenArguments keygen_arguments;
  const CLI::App* keygen = AddKeygen(app, &keygen_arguments);
  CLI11_PARSE(app, argc, argv);
  try {
    if (keygen->parsed()) {
      return Keygen(keygen_arguments);
    }
    YamlOptions yaml;
    options.Visit(yaml);
    options_arguments.Read(&yaml);
    if (options_arguments.Printed(yaml)) {
      return 0;
    }
    return Run(arguments, options, options_arguments.Source(), yaml.PrintWithoutHelp());
  } catch (const std::exception& error) {
    return Failed("pangea-agent-handler", error);
  }
}

}  // namespace pangea::agent_handler
