#include "server/command_line.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <stdexcept>

#include "bus/bus.h"
#include "bus/bus_url.h"
#include "link/wire.h"
#include "options/command_line.h"
#include "server/server.h"
#include "site/site.h"
#include "tags/tag_file.h"
#include "web/web_rules.h"

namespace pangea::server {
namespace {

namespace fs = std::filesystem;

// Differs from a server's bus; messages between a worker's verifiers stay on this host.
constexpr char kWorkerBusUrl[] = "udpm://239.255.76.67:7701?ttl=0&recv_buf_size=4194304";

struct Arguments {
  ServerSetup options;
  std::string site;
  std::string worker;
  std::string options_folder;
  std::vector<std::string> option_files;
};

void AddFolders(CLI::App& app, CLI::Option* site, Arguments* arguments) {
  ServerSetup& options = arguments->options;
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
}

void AddSeveralHosts(CLI::App& app, CLI::Option* site, Arguments* arguments) {
  ServerSetup& options = arguments->options;
  CLI::Option* nats = app.add_option(
      "--nats", options.cluster.nats,
      "several hosts, by NATS at this URL (docs/cluster.md): serves once this host has "
      "the site; workers verify");
  app.add_option("--ca", options.cluster.ca, "of --nats tls://: certificate of its authority");
  app.add_option("--credentials", options.cluster.credentials,
                 "of --nats: file with user and password, mode 0600");
  app.add_option("--replicas", options.cluster.replicas,
                 "nodes of NATS that have each message (default: as the streams are)")
      ->check(CLI::Range(1, 5));
  app.add_flag("--edges", options.cluster.edges,
               "agents may come over edges: hosts with pangea-bridge --role edge")
      ->needs(nats);
  app.add_option("--worker", arguments->worker,
                 "a worker alone: verifies for the server of the site of this name")
      ->excludes(site);
  app.add_option("--matches", options.cluster.max_matches, "a worker's matches at a time")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
}

void AddWeb(CLI::App& app, CLI::Option* site, ServerSetup* options) {
  CLI::Option* http = app.add_option(
      "--http", options->http,
      "ADDRESS:PORT of the anchors' API for apps, as 127.0.0.1:8090; without it none");
  app.add_option("--allow-origin", options->origins,
                 "pages of this origin may use that API, as https://app.example; repeatable")
      ->needs(http);
  app.add_option("--http-name", options->names,
                 "a name of this machine by which apps may ask that API; repeatable")
      ->needs(http);
  app.add_option("--phone", options->phone_port,
                 "pangea-gateway too, which lets phones' browsers in, on this TCP port")
      ->expected(0, 1)
      ->default_str("8443")
      ->needs(site);
}

void AddArguments(CLI::App& app, Arguments* arguments) {
  ServerSetup& options = arguments->options;
  CLI::Option* site = app.add_option(
      "--site", arguments->site,
      "folder of a site: journal, keys, options, logs, buses; made at the first start");
  app.add_option(
      "--bus", options.bus,
      fmt::format("LCM URL of the server bus (default: the site's, or {})", kDefaultBusUrl));
  app.add_option(
      "--link", options.link,
      fmt::format("LCM URL of the link bus (default: the site's, or {})", kDefaultLinkUrl));
  app.add_option("--threads", options.threads,
                 "that verify candidates, within one map as between maps")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  AddFolders(app, site, arguments);
  AddSeveralHosts(app, site, arguments);
  AddWeb(app, site, &options);
}

// Relative paths on the command line are not relative to the site.
void MakePathsAbsolute(Arguments* arguments) {
  for (std::string& text : arguments->option_files) {
    if (const size_t equals = text.find('='); equals != std::string::npos) {
      text.replace(equals + 1, std::string::npos, fs::absolute(text.substr(equals + 1)));
    }
  }
  ClusterOptions& cluster = arguments->options.cluster;
  for (fs::path* path : {&cluster.ca, &cluster.credentials}) {
    *path = path->empty() ? *path : fs::absolute(*path);
  }
}

// Takes the values that the command line does not give from the site. Works in its folder, and
// names its files relative to it: if somebody moves the locked folder, the processes stay in it,
// and write into no other one that gets its name.
void UseSite(site::Site site, Arguments* arguments) {
  MakePathsAbsolute(arguments);
  fs::current_path(site.folder);
  site.folder = "";
  ServerSetup& options = arguments->options;
  options.site = ".";
  options.journal = site.journal();
  options.keys = site.keys();
  options.logs = site.logs();
  options.checkpoints = site.checkpoints();
  if (fs::exists(site.tags())) {
    ReadTagFile(site.tags());  // a wrong one is told at once
    options.tags = site.tags();
  }
  arguments->options_folder = site.options();
  options.bus = options.bus.empty() ? site.description.bus : options.bus;
  options.link = options.link.empty() ? site.description.link : options.link;
}

void UseDefaults(ServerSetup* options) {
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

void UseProcessOptions(Arguments* arguments) {
  if (!arguments->options_folder.empty()) {
    AddOptionsFolder(arguments->options_folder, &arguments->options);
  }
  for (const std::string& file : arguments->option_files) {
    AddProcessOptions(file, &arguments->options);
  }
}

// Otherwise each process would refuse the URL, again after each of its starts.
void RequireBus(const std::string& option, const std::string& url) {
  if (const std::string why = WhyNoBus(url); !why.empty()) {
    throw std::runtime_error(fmt::format("{}: {}", option, why));
  }
}

int RunWorker(Arguments* arguments) {
  ServerSetup& options = arguments->options;
  if (options.cluster.nats.empty()) {
    throw std::runtime_error("--worker: give --nats with the URL of the site's NATS");
  }
  options.cluster.site = arguments->worker;
  options.bus = options.bus.empty() ? kWorkerBusUrl : options.bus;
  options.logs = options.logs.empty() ? "worker.logs" : options.logs;
  RequireBus("--bus", options.bus);
  UseProcessOptions(arguments);
  return ServeAsWorker(options);
}

int Run(Arguments* arguments) {
  web::CheckOrigins(arguments->options.origins);
  if (const std::string& http = arguments->options.http; !http.empty()) {
    [[maybe_unused]] const auto checked = web::AddressAndPort(http);
  }
  if (!arguments->worker.empty()) {
    return RunWorker(arguments);
  }
  std::optional<site::SiteLock> lock;
  ServerSetup& options = arguments->options;
  if (!arguments->site.empty()) {
    const site::Site site = site::OpenSite(arguments->site);
    lock.emplace(site);
    UseSite(site, arguments);
    options.cluster.site = site.description.name;
  }
  UseDefaults(&options);
  RequireTwoBuses("--bus", options.bus, "--link", options.link);
  RequireBus("--bus", options.bus);
  RequireBus("--link", options.link);
  UseProcessOptions(arguments);
  if (!options.cluster.nats.empty()) {
    if (options.cluster.site.empty()) {
      throw std::runtime_error("--nats: give --site FOLDER, whose name the site has there");
    }
    options.cluster.holder = DrawHolder();
  }
  return Serve(options);
}

}  // namespace

int RunCommandLine(int argc, char** argv) {
  CLI::App app("Runs the server's processes, and starts again what ends", "pangea-server");
  AddVersion(app);
  Arguments arguments;
  AddArguments(app, &arguments);
  CLI11_PARSE(app, argc, argv);
  try {
    return Run(&arguments);
  } catch (const std::exception& error) {
    return Failed("pangea-server", error);
  }
}

}  // namespace pangea::server
