#include "uplink/command_line.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "bus/bus_url.h"
#include "bus/status_log.h"
#include "link/agent_key.h"
#include "options/command_line.h"
#include "options/options_arguments.h"
#include "uplink/edit_spool.h"
#include "uplink/uplink_process.h"

namespace pangea::uplink {
namespace {

struct Arguments {
  int32_t agent_id = 0;
  std::string key, spool;
  std::string bus = kDefaultBusUrl;
  std::string link = kDefaultLinkUrl;
  std::optional<double> bandwidth_kb_per_s, budget_kb_per_s;
};

void AddArguments(CLI::App& app, Arguments& a) {
  app.add_option("--agent", a.agent_id, "agent id")->check(CLI::Range(1, 65535));
  app.add_option("--key", a.key, "the agent's key file (pangea-agent-handler keygen)");
  app.add_option("--bus", a.bus, "LCM URL of the agent's bus")->capture_default_str();
  app.add_option("--link", a.link, "LCM URL of the link bus")->capture_default_str();
  app.add_option(
      "--spool", a.spool,
      "folder for what the server has yet to acknowledge (default: none, it is kept in memory)");
  app.add_option("--bandwidth", a.bandwidth_kb_per_s,
                 "kB/s of keyframes at most, repeats included; over --options");
  app.add_option("--budget", a.budget_kb_per_s,
                 "kB/s of all that may be sent; keyframes are thinned to fit (0: no bound); over "
                 "--options");
}

int Run(const Arguments& a, const UplinkOptions& options, const std::string& options_source,
        const std::string& told_options) {
  if (a.agent_id == 0 || a.key.empty()) {
    throw std::runtime_error("give --agent ID and --key FILE");
  }
  RequireTwoBuses("--bus", a.bus, "--link", a.link);
  std::optional<Spool> spool;
  std::optional<EditSpool> edit_spool;
  if (!a.spool.empty()) {
    spool.emplace(a.spool, a.agent_id, options.spool_disk_bytes);
    edit_spool.emplace(a.spool, a.agent_id);
  }
  LcmBus agent_bus(a.bus);
  LcmBus link_bus(a.link, LcmBus::Fragments::kRefused);
  UplinkProcess process(agent_bus, link_bus, a.agent_id, ReadKeyFileOf(a.key, a.agent_id), options,
                        spool ? &*spool : nullptr, edit_spool ? &*edit_spool : nullptr);
  StartLog("pangea-uplink",
           fmt::format("agent {}, bus {}, link {}, key {}, {}, {}", a.agent_id, a.bus, a.link,
                       a.key, a.spool.empty() ? "no spool" : "spool " + a.spool, options_source));
  const std::string name = fmt::format("uplink_{}", a.agent_id);
  OptionsAnnouncer announcer(agent_bus, name, told_options);
  const int exit_code = RunPolledProcess(agent_bus, link_bus, process, announcer);
  Log(name, "ended; " + process.Totals());
  return exit_code;
}

}  // namespace

int RunCommandLine(int argc, char** argv) {
  CLI::App app("Carries one agent's keyframes to the server, and its corrections back",
               "pangea-uplink");
  AddVersion(app);
  Arguments arguments;
  UplinkOptions options;
  AddArguments(app, arguments);
  OptionsArguments options_arguments(app);
  CLI11_PARSE(app, argc, argv);
  try {
    YamlOptions yaml;
    options.Visit(yaml);
    options_arguments.Read(&yaml);
    options.sender.bandwidth_kb_per_s =
        arguments.bandwidth_kb_per_s.value_or(options.sender.bandwidth_kb_per_s);
    options.budget_kb_per_s = arguments.budget_kb_per_s.value_or(options.budget_kb_per_s);
    if (const auto invalid = options.Invalid()) {
      throw std::runtime_error(*invalid);
    }
    if (options_arguments.Printed(yaml)) {
      return 0;
    }
    return Run(arguments, options, options_arguments.Source(), yaml.PrintWithoutHelp());
  } catch (const std::exception& error) {
    return Failed("pangea-uplink", error);
  }
}

}  // namespace pangea::uplink
