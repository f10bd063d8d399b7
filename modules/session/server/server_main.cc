// pangea-server: all server processes by one command.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <optional>
#include <stdexcept>

#include "bus/bus.h"
#include "link/wire.h"
#include "session/server/server.h"
#include "site/site.h"

namespace pangea::session {
namespace {

struct Arguments {
  ServerOptions options;
  std::string site;
  std::string options_folder;
  std::vector<std::string> option_files;
  std::vector<std::string> without;
};

void AddArguments(CLI::App& app, Arguments* arguments) {
  ServerOptions& options = arguments->options;
  CLI::Option* site = app.add_option(
      "--site", arguments->site,
      "folder of a site: journal, keys, options, logs, buses; made at the first start");
  app.add_option(
      "--bus", options.bus,
      fmt::format("LCM URL of the server bus (default: the site's, or {})", kDefaultBusUrl));
  app.add_option(
      "--link", options.link,
      fmt::format("LCM URL of the link bus (default: the site's, or {})", kDefaultLinkUrl));
  app.add_option("--journal", options.journal,
                 "without --site: LCM log to append to; an existing one is loaded")
      ->excludes(site);
  app.add_option("--keys", options.keys,
                 "without --site: folder with the key of each agent that may join")
      ->excludes(site);
  app.add_option("--logs", options.logs,
                 "folder for what the processes say (default: <journal>.logs)")
      ->excludes(site);
  app.add_option("--options-dir", arguments->options_folder,
                 "folder with options: fusion.yaml, posegraph.yaml, ...")
      ->excludes(site);
  app.add_option("--options", arguments->option_files,
                 "PROCESS=FILE.yaml, before what the folder has");
  app.add_option("--without", arguments->without,
                 "PROCESS that is not started, as others do its part: fusion and inter_map_ba "
                 "where workers verify (pangea-bridge)");
  app.add_option("--http", options.http,
                 "ADDRESS:PORT of the anchors' API for apps, as 127.0.0.1:8090; without it none");
  app.add_option("--phone", options.phone_port,
                 "pangea-gateway too, which lets phones' browsers in, on this TCP port")
      ->expected(0, 1)
      ->default_str("8443")
      ->needs(site);
}

// What the command line leaves open is the site's.
void UseSite(const site::Site& site, Arguments* arguments) {
  ServerOptions& options = arguments->options;
  options.site = site.folder;
  options.journal = site.journal();
  options.keys = site.keys();
  options.logs = site.logs();
  options.checkpoints = site.checkpoints();
  arguments->options_folder = site.options();
  options.bus = options.bus.empty() ? site.description.bus : options.bus;
  options.link = options.link.empty() ? site.description.link : options.link;
}

void UseDefaults(ServerOptions* options) {
  if (options->journal.empty() || options->keys.empty()) {
    throw std::runtime_error("give --site FOLDER, or --journal FILE and --keys FOLDER");
  }
  options->bus = options->bus.empty() ? kDefaultBusUrl : options->bus;
  options->link = options->link.empty() ? kDefaultLinkUrl : options->link;
  if (options->checkpoints.empty()) {
    options->checkpoints = options->journal.string() + ".checkpoints";
  }
  if (options->logs.empty()) {
    options->logs = options->journal.string() + ".logs";
  }
}

int Run(Arguments* arguments) {
  std::optional<site::SiteLock> lock;
  if (!arguments->site.empty()) {
    const site::Site site = site::OpenSite(arguments->site);
    lock.emplace(site);
    UseSite(site, arguments);
  }
  UseDefaults(&arguments->options);
  if (!arguments->options_folder.empty()) {
    AddOptionsFolder(arguments->options_folder, &arguments->options);
  }
  for (const std::string& file : arguments->option_files) {
    AddProcessOptions(file, &arguments->options);
  }
  for (const std::string& process : arguments->without) {
    LeaveOut(process, &arguments->options);
  }
  return Serve(arguments->options);
}

}  // namespace
}  // namespace pangea::session

int main(int argc, char** argv) {
  CLI::App app("Runs the server's processes, and starts again what ends", "pangea-server");
  pangea::session::Arguments arguments;
  pangea::session::AddArguments(app, &arguments);
  CLI11_PARSE(app, argc, argv);
  try {
    return pangea::session::Run(&arguments);
  } catch (const std::exception& error) {
    std::cerr << fmt::format("pangea-server: {}\n", error.what());
    return 1;
  }
}
