// pangea-link-emulator: emulates a bad link between one agent and the server, for tests and
// measurements.

#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "bus/bus_url.h"
#include "bus/status_log.h"
#include "link_emulator/link_emulator_process.h"
#include "options/command_line.h"
#include "options/options_arguments.h"

int main(int argc, char** argv) {
  CLI::App app(
      "Relays one agent's link between two buses, and loses, delays, reorders, doubles and cuts",
      "pangea-link-emulator");
  int32_t agent_id = 0;
  std::string agent_link, server_link, status_bus;
  app.add_option("--agent", agent_id, "agent id")->check(CLI::Range(1, 65535));
  app.add_option("--agent-link", agent_link, "LCM URL of the agent's link bus");
  app.add_option("--server-link", server_link, "LCM URL of the server's link bus");
  app.add_option("--bus", status_bus, "LCM URL of the bus its status goes to");
  pangea::OptionsArguments options_arguments(app);
  CLI11_PARSE(app, argc, argv);
  try {
    pangea::LinkConditions conditions;
    pangea::YamlOptions yaml;
    conditions.Visit(yaml);
    options_arguments.Read(&yaml);
    if (options_arguments.Printed(yaml)) {
      return 0;
    }
    if (agent_id == 0 || agent_link.empty() || server_link.empty() || status_bus.empty()) {
      throw std::runtime_error("give --agent ID, --agent-link, --server-link and --bus URL");
    }
    pangea::RequireTwoBuses("--agent-link", agent_link, "--server-link", server_link);
    constexpr auto kNoFragments = pangea::LcmBus::Fragments::kRefused;
    pangea::LcmBus agent_bus(agent_link, kNoFragments), server_bus(server_link, kNoFragments);
    pangea::LcmBus status(status_bus);
    pangea::LinkEmulatorProcess process(agent_bus, server_bus, status, agent_id, conditions,
                                        pangea::SteadyMicros());
    pangea::StartLog("pangea-link-emulator",
                     fmt::format("agent {}, {}", agent_id, pangea::Describe(conditions)));
    pangea::OptionsAnnouncer announcer(status, fmt::format("link_emulator_{}", agent_id),
                                       yaml.PrintWithoutHelp());
    return pangea::RunPolledProcess(agent_bus, server_bus, process, announcer);
  } catch (const std::exception& error) {
    return pangea::Failed("pangea-link-emulator", error);
  }
}
