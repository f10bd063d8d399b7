// pangea-link-emulator: a bad link between one agent and the server, for tests and measurements.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <iostream>

#include "link_emulator/link_emulator_process.h"
#include "options/yaml_options.h"

int main(int argc, char** argv) {
  CLI::App app(
      "Relays one agent's link between two buses, and loses, delays, reorders, doubles and cuts",
      "pangea-link-emulator");
  int32_t agent_id = 0;
  std::string agent_link, server_link, status_bus, file;
  app.add_option("--agent", agent_id, "agent id")->required()->check(CLI::Range(1, 65535));
  app.add_option("--agent-link", agent_link, "LCM URL of the agent's link bus")->required();
  app.add_option("--server-link", server_link, "LCM URL of the server's link bus")->required();
  app.add_option("--bus", status_bus, "LCM URL of the bus its status goes to")->required();
  app.add_option("--options", file, "the link's conditions, YAML (default: a perfect link)");
  CLI11_PARSE(app, argc, argv);
  try {
    pangea::LinkConditions conditions;
    pangea::YamlOptions yaml;
    conditions.Visit(yaml);
    if (!file.empty()) {
      yaml.ReadFile(file);
    }
    std::cout << yaml.Print() << std::flush;
    constexpr auto kNoFragments = pangea::LcmBus::Fragments::kRefused;
    pangea::LcmBus agent_bus(agent_link, kNoFragments), server_bus(server_link, kNoFragments);
    pangea::LcmBus status(status_bus);
    pangea::LinkEmulatorProcess process(agent_bus, server_bus, status, agent_id, conditions,
                                        pangea::SteadyMicros());
    return pangea::RunPolledProcess(agent_bus, server_bus, process);
  } catch (const std::exception& error) {
    std::cerr << fmt::format("pangea-link-emulator: {}\n", error.what());
    return 1;
  }
}
