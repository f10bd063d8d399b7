// pangea-agent-handler: joins the link bus and the server bus, and owns the journal. Also makes the
// agents' keys.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <iostream>

#include "agent_handler/agent_handler_process.h"

namespace {

struct Arguments {
  std::string link = "udpm://239.255.76.68:7668?ttl=1&recv_buf_size=4194304";
  std::string server = pangea::kDefaultBusUrl;
  std::string journal;
  std::string keys;
  pangea::AgentHandlerOptions options;
  int32_t keygen_agent = 0;
  std::string keygen_out;
};

CLI::App* AddKeygen(CLI::App& app, Arguments* arguments) {
  CLI::App* keygen = app.add_subcommand("keygen", "Make the key that lets an agent in, and exit");
  keygen->add_option("--agent", arguments->keygen_agent, "agent id")
      ->required()
      ->check(CLI::Range(1, 65535));
  keygen->add_option("--out", arguments->keygen_out,
                     "file to make; never written over (default: agent_ID.key here)");
  return keygen;
}

int Keygen(const Arguments& arguments) {
  const std::string file = arguments.keygen_out.empty()
                               ? pangea::KeyFileName(arguments.keygen_agent)
                               : arguments.keygen_out;
  pangea::MakeKeyFile(file, arguments.keygen_agent);
  std::cout << fmt::format(
      "{}: for agent {} (pangea-uplink --key); the server needs a copy in its "
      "folder of keys (--keys)\n",
      file, arguments.keygen_agent);
  return 0;
}

int Serve(const Arguments& arguments) {
  if (arguments.journal.empty() || arguments.keys.empty()) {
    throw std::runtime_error("give --journal FILE and --keys FOLDER (or: keygen --agent ID)");
  }
  pangea::LcmBus link_bus(arguments.link);
  pangea::LcmBus server_bus(arguments.server);
  pangea::AgentHandlerProcess process(link_bus, server_bus, arguments.journal, arguments.keys,
                                      pangea::WallUtime(), arguments.options);
  return pangea::RunPolledProcess(link_bus, server_bus, process);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Takes keyframes of all agents, journals and acknowledges them",
               "pangea-agent-handler");
  Arguments arguments;
  app.add_option("--link", arguments.link, "LCM URL of the link bus")->capture_default_str();
  app.add_option("--server", arguments.server, "LCM URL of the server bus")->capture_default_str();
  app.add_option("--journal", arguments.journal, "LCM log to append to; an existing one is loaded");
  app.add_option("--keys", arguments.keys, "folder with the key of each agent that may join");
  app.add_option("--cache-bytes", arguments.options.receiver.cache_bytes, "receive cache per agent")
      ->capture_default_str()
      ->check(CLI::Range(2 * pangea::kMaxKeyframeBytes, 1 << 30));
  const CLI::App* keygen = AddKeygen(app, &arguments);
  CLI11_PARSE(app, argc, argv);
  try {
    return keygen->parsed() ? Keygen(arguments) : Serve(arguments);
  } catch (const std::exception& error) {
    std::cerr << fmt::format("pangea-agent-handler: {}\n", error.what());
    return 1;
  }
}
