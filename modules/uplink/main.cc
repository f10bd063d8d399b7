// pangea-uplink: joins one agent's bus and the link bus.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <iostream>

#include "bus/status_log.h"
#include "link/agent_key.h"
#include "options/options_arguments.h"
#include "uplink/uplink_process.h"

int main(int argc, char** argv) {
  CLI::App app("Carries one agent's keyframes to the server, and its corrections back",
               "pangea-uplink");
  int32_t agent_id = 0;
  std::string key;
  std::string bus = pangea::kDefaultBusUrl;
  std::string link = pangea::kDefaultLinkUrl;
  pangea::UplinkOptions options;
  std::string spool_folder;
  app.add_option("--agent", agent_id, "agent id")->check(CLI::Range(1, 65535));
  app.add_option("--key", key, "the agent's key file (pangea-agent-handler keygen)");
  app.add_option("--bus", bus, "LCM URL of the agent's bus")->capture_default_str();
  app.add_option("--link", link, "LCM URL of the link bus")->capture_default_str();
  app.add_option(
      "--spool", spool_folder,
      "folder for what the server has yet to acknowledge (default: none, it is kept in memory)");
  std::optional<double> bandwidth_kb_per_s, budget_kb_per_s;
  app.add_option("--bandwidth", bandwidth_kb_per_s,
                 "kB/s of keyframes at most, repeats included; over --options");
  app.add_option("--budget", budget_kb_per_s,
                 "kB/s of all that may be sent; keyframes are thinned to fit (0: no bound); over "
                 "--options");
  pangea::OptionsArguments options_arguments(app);
  CLI11_PARSE(app, argc, argv);
  try {
    pangea::YamlOptions yaml;
    options.Visit(yaml);
    options_arguments.Read(&yaml);
    options.sender.bandwidth_kb_per_s =
        bandwidth_kb_per_s.value_or(options.sender.bandwidth_kb_per_s);
    options.budget_kb_per_s = budget_kb_per_s.value_or(options.budget_kb_per_s);
    if (const auto invalid = options.Invalid()) {
      throw std::runtime_error(*invalid);
    }
    if (options_arguments.Printed(yaml)) {
      return 0;
    }
    if (agent_id == 0 || key.empty()) {
      throw std::runtime_error("give --agent ID and --key FILE");
    }
    std::optional<pangea::Spool> spool;
    std::optional<pangea::EditSpool> edit_spool;
    if (!spool_folder.empty()) {
      spool.emplace(spool_folder, agent_id, options.spool_disk_bytes);
      edit_spool.emplace(spool_folder, agent_id);
    }
    pangea::LcmBus agent_bus(bus);
    pangea::LcmBus link_bus(link, pangea::LcmBus::Fragments::kRefused);
    pangea::UplinkProcess process(agent_bus, link_bus, agent_id,
                                  pangea::ReadKeyFileOf(key, agent_id), options,
                                  spool ? &*spool : nullptr, edit_spool ? &*edit_spool : nullptr);
    pangea::StartLog("pangea-uplink",
                     fmt::format("agent {}, bus {}, link {}, key {}, {}, {}", agent_id, bus, link,
                                 key, spool_folder.empty() ? "no spool" : "spool " + spool_folder,
                                 options_arguments.Source()));
    pangea::OptionsAnnouncer announcer(agent_bus, fmt::format("uplink_{}", agent_id),
                                       yaml.PrintWithoutHelp());
    return pangea::RunPolledProcess(agent_bus, link_bus, process, announcer);
  } catch (const std::exception& error) {
    std::cerr << fmt::format("pangea-uplink: {}\n", error.what());
    return 1;
  }
}
