// pangea-server: all server processes by one command.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <iostream>

#include "bus/bus.h"
#include "link/wire.h"
#include "session/server.h"

int main(int argc, char** argv) {
  CLI::App app("Runs the server's processes, and starts again what ends", "pangea-server");
  pangea::session::ServerOptions options;
  options.bus = pangea::kDefaultBusUrl;
  options.link = pangea::kDefaultLinkUrl;
  std::string folder;
  std::vector<std::string> files;
  app.add_option("--bus", options.bus, "LCM URL of the server bus")->capture_default_str();
  app.add_option("--link", options.link, "LCM URL of the link bus")->capture_default_str();
  app.add_option("--journal", options.journal, "LCM log to append to; an existing one is loaded")
      ->required();
  app.add_option("--keys", options.keys, "folder with the key of each agent that may join")
      ->required();
  app.add_option("--logs", options.logs,
                 "folder for what the processes say (default: <journal>.logs)");
  app.add_option("--options-dir", folder, "folder with options: fusion.yaml, posegraph.yaml, ...");
  app.add_option("--options", files, "PROCESS=FILE.yaml, before what the folder has");
  CLI11_PARSE(app, argc, argv);
  try {
    if (!folder.empty()) {
      pangea::session::AddOptionsFolder(folder, &options);
    }
    for (const std::string& file : files) {
      pangea::session::AddProcessOptions(file, &options);
    }
    if (options.logs.empty()) {
      options.logs = options.journal.string() + ".logs";
    }
    return pangea::session::Serve(options);
  } catch (const std::exception& error) {
    std::cerr << fmt::format("pangea-server: {}\n", error.what());
    return 1;
  }
}
