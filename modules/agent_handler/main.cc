// pangea-agent-handler: joins the link bus and the server bus, and owns the journal.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <iostream>

#include "agent_handler/agent_handler_process.h"

int main(int argc, char** argv) {
  CLI::App app("Takes keyframes of all agents, journals and acknowledges them",
               "pangea-agent-handler");
  std::string link = "udpm://239.255.76.68:7668?ttl=1&recv_buf_size=4194304";
  std::string server = "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=4194304";
  std::string journal;
  pangea::AgentHandlerOptions options;
  app.add_option("--link", link, "LCM URL of the link bus")->capture_default_str();
  app.add_option("--server", server, "LCM URL of the server bus")->capture_default_str();
  app.add_option("--journal", journal, "LCM log to append to; an existing one is loaded")
      ->required();
  app.add_option("--cache-bytes", options.receiver.cache_bytes, "receive cache per agent")
      ->capture_default_str()
      ->check(CLI::Range(2 * pangea::kMaxKeyframeBytes, 1 << 30));
  CLI11_PARSE(app, argc, argv);
  try {
    pangea::LcmBus link_bus(link);
    pangea::LcmBus server_bus(server);
    pangea::AgentHandlerProcess process(link_bus, server_bus, journal, pangea::WallUtime(),
                                        options);
    return pangea::RunPolledProcess(link_bus, server_bus, process);
  } catch (const std::exception& error) {
    std::cerr << fmt::format("pangea-agent-handler: {}\n", error.what());
    return 1;
  }
}
