#include "link_emulator/command_line.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "bus/bus_url.h"
#include "bus/status_log.h"
#include "link_emulator/link_emulator_process.h"
#include "options/command_line.h"
#include "options/options_arguments.h"

namespace pangea::link_emulator {
namespace {

struct Arguments {
  int32_t agent_id = 0;
  std::string agent_link, server_link, status_bus;
};

void AddArguments(CLI::App& app, Arguments& a) {
  app.add_option("--agent", a.agent_id, "agent id")->check(CLI::Range(1, 65535));
  app.add_option("--agent-link", a.agent_link, "LCM URL of the agent's link bus");
  app.add_option("--server-link", a.server_link, "LCM URL of the server's link bus");
  app.add_option("--bus", a.status_bus, "LCM URL of the bus its status goes to");
}

int Run(const Arguments& a, const LinkConditions& conditions, const std::string& told_options) {
  if (a.agent_id == 0 || a.agent_link.empty() || a.server_link.empty() || a.status_bus.empty()) {
    throw std::runtime_error("give --agent ID, --agent-link, --server-link and --bus URL");
  }
  RequireTwoBuses("--agent-link", a.agent_link, "--server-link", a.server_link);
  constexpr auto kNoFragments = LcmBus::Fragments::kRefused;
  LcmBus agent_bus(a.agent_link, kNoFragments), server_bus(a.server_link, kNoFragments);
  LcmBus status(a.status_bus);
  LinkEmulatorProcess process(agent_bus, server_bus, status, a.agent_id, conditions,
                              SteadyMicros());
  StartLog("pangea-link-emulator", fmt::format("agent {}, {}", a.agent_id, Describe(conditions)));
  OptionsAnnouncer announcer(status, fmt::format("link_emulator_{}", a.agent_id), told_options);
  return RunPolledProcess(agent_bus, server_bus, process, announcer);
}

}  // namespace

int RunCommandLine(int argc, char** argv) {
  CLI::App app(
      "Relays one agent's link between two buses, and loses, delays, reorders, doubles and cuts",
      "pangea-link-emulator");
  AddVersion(app);
  Arguments arguments;
  AddArguments(app, arguments);
  OptionsArguments options_arguments(app);
  CLI11_PARSE(app, argc, argv);
  try {
    LinkConditions conditions;
    YamlOptions yaml;
    conditions.Visit(yaml);
    options_arguments.Read(&yaml);
    if (options_arguments.Printed(yaml)) {
      return 0;
    }
    return Run(arguments, conditions, yaml.PrintWithoutHelp());
  } catch (const std::exception& error) {
    return Failed("pangea-link-emulator", error);
  }
}

}  // namespace pangea::link_emulator
