// pangea-uplink: joins one agent's bus and the link bus.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <iostream>

#include "bus/status_log.h"
#include "link/agent_key.h"
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
  int64_t spool_disk_bytes = 4'000'000'000;  // 40 hours of walking
  app.add_option("--agent", agent_id, "agent id")->required()->check(CLI::Range(1, 65535));
  app.add_option("--key", key, "the agent's key file (pangea-agent-handler keygen)")->required();
  app.add_option("--bus", bus, "LCM URL of the agent's bus")->capture_default_str();
  app.add_option("--link", link, "LCM URL of the link bus")->capture_default_str();
  app.add_option("--packet-bytes", options.sender.payload_bytes, "keyframe bytes per packet")
      ->capture_default_str();
  app.add_option("--bandwidth", options.sender.bandwidth_kb_per_s,
                 "kB/s of keyframes at most, repeats included")
      ->capture_default_str();
  app.add_option("--spool", spool_folder,
                 "folder for unacknowledged keyframes (default: none, they are kept in memory)");
  app.add_option("--spool-disk-bytes", spool_disk_bytes, "what the folder may hold; then memory")
      ->capture_default_str();
  app.add_option("--spool-bytes", options.sender.max_spool_bytes,
                 "unacknowledged keyframes kept in memory; beyond it the newest are not taken")
      ->capture_default_str();
  app.add_option("--budget", options.budget_kb_per_s,
                 "kB/s of all that may be sent; keyframes are thinned to fit (0: no bound)")
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    if (const auto invalid = options.Invalid()) {
      throw std::runtime_error(*invalid);
    }
    std::optional<pangea::Spool> spool;
    if (!spool_folder.empty()) {
      spool.emplace(spool_folder, agent_id, spool_disk_bytes);
    }
    pangea::LcmBus agent_bus(bus);
    pangea::LcmBus link_bus(link, pangea::LcmBus::Fragments::kRefused);
    pangea::UplinkProcess process(agent_bus, link_bus, agent_id,
                                  pangea::ReadKeyFileOf(key, agent_id), options,
                                  spool ? &*spool : nullptr);
    pangea::StartLog("pangea-uplink",
                     fmt::format("agent {}, bus {}, link {}, key {}, {}", agent_id, bus, link, key,
                                 spool_folder.empty() ? "no spool" : "spool " + spool_folder));
    return pangea::RunPolledProcess(agent_bus, link_bus, process);
  } catch (const std::exception& error) {
    std::cerr << fmt::format("pangea-uplink: {}\n", error.what());
    return 1;
  }
}
