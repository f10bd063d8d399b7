#include "server/server.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <functional>
#include <set>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include "blas/blas.h"
#include "bus/process.h"
#include "bus/wall_clock.h"
#include "options/nearest_word.h"
#include "processes/child_process.h"
#include "processes/kept_processes.h"
#include "server/agent_lines.h"
#include "server/checkpoints.h"
#include "server/server_processes.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;

constexpr double kServerStopGrace_s = 5;
constexpr const char* kGateway = "gateway";
constexpr const char* kBridge = "bridge";
constexpr const char* kEdges = "edges";
constexpr const char* kThinningOptions = "thinning.yaml";  // of pangea-site compact
// Processes that workers run, and a server on several hosts does not.
constexpr const char* kVerifiers[] = {"fusion", "inter_map_ba"};
constexpr std::chrono::milliseconds kServerLookInterval{100};

void Say(const std::string& line) {
  fmt::print("{}\n", line);
  std::fflush(stdout);
}

std::vector<std::string> Command(const std::string& process, const ServerSetup& options) {
  std::vector<std::string> argv{ProgramOf(process)};
  if (process == "agent_handler") {
    argv.insert(argv.end(), {"--link", options.link, "--bus", options.bus, "--journal",
                             options.journal.string(), "--keys", options.keys.string(),
                             "--checkpoints", options.checkpoints.string()});
    if (!options.cluster.nats.empty()) {
      argv.push_back("--replicated");
    }
  } else {
    argv.insert(argv.end(), {"--bus", options.bus});
  }
  if (std::ranges::find(kVerifiers, process) != std::end(kVerifiers)) {
    argv.insert(argv.end(), {"--threads", std::to_string(options.threads)});
  }
  if (process == "fusion" && !options.tags.empty()) {
    argv.insert(argv.end(), {"--tags", options.tags.string()});
  }
  if (process == "anchors" && !options.http.empty()) {
    argv.insert(argv.end(), {"--http", options.http});
    for (const std::string& origin : options.origins) {
      argv.insert(argv.end(), {"--allow-origin", origin});
    }
    for (const std::string& name : options.names) {
      argv.insert(argv.end(), {"--http-name", name});
    }
  }
  if (const auto file = options.options.find(process); file != options.options.end()) {
    argv.insert(argv.end(), {"--options", file->second.string()});
  }
  return argv;
}

std::vector<std::string> GatewayCommand(const ServerSetup& options) {
  return {ProgramOf(kGateway),
          "--site",
          options.site.string(),
          "--bus",
          options.bus,
          "--link",
          options.link,
          "--port",
          std::to_string(*options.phone_port)};
}

bool IsVerifier(const std::string& process) {
  return std::ranges::find(kVerifiers, process) != std::end(kVerifiers);
}

bool IsServerProcess(const std::string& process) {
  return std::ranges::find(kServerProcesses, process) != std::end(kServerProcesses);
}

// Restarts ended processes; returns those that were given up and that the server needs. A gateway
// that has run is not needed: what phones do to it must not end the map. One that cannot start is:
// somebody has just asked for it, and can mend that.
std::vector<std::string> ReviveAll(KeptProcesses* kept) {
  std::vector<std::string> given_up;
  for (const KeptProcesses::Revived& revived : kept->Revive()) {
    const bool needed = revived.name != kGateway || !revived.ever_ran;
    const std::string end =
        needed ? "the server ends" : "the server goes on; phones need its next start";
    Say(fmt::format("{} ended ({}); {}", revived.name, revived.why,
                    revived.given_up
                        ? fmt::format("given up after {} times; {}", revived.unexpected, end)
                        : "starting it again"));
    if (revived.given_up && needed) {
      given_up.push_back(revived.name);
    }
  }
  return given_up;
}

// Runs until a signal comes, a process is given up, or `continues` is false, then stops all.
// Returns those given up.
std::vector<std::string> KeepAlive(KeptProcesses* kept, const std::function<bool()>& continues) {
  std::vector<std::string> given_up;
  while (!StopRequested() && given_up.empty() && continues()) {
    given_up = ReviveAll(kept);
    std::this_thread::sleep_for(kServerLookInterval);
  }
  kept->StopAll(kServerStopGrace_s);
  return given_up;
}

void Start(KeptProcesses* kept, const std::string& process, const std::vector<std::string>& argv) {
  kept->Start(process, argv);
  Say(fmt::format("started {}", fmt::join(argv, " ")));
}

// Names a file that looks like a process' options and is not read by one.
void SayUnusedOptions(const fs::path& folder) {
  std::vector<std::string> known;
  for (const std::string process : kServerProcesses) {
    known.push_back(process + ".yaml");
  }
  std::set<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    files.insert(entry.path());
  }
  for (const fs::path& file : files) {
    const std::string name = file.filename();
    const bool is_options = file.extension() == ".yaml" || file.extension() == ".yml";
    if (is_options && name != kThinningOptions && std::ranges::find(known, name) == known.end()) {
      Say(fmt::format("{}: no process reads it{}", file.string(), NearestWordHint(name, known)));
    }
  }
}

using Commands = std::vector<std::pair<std::string, std::vector<std::string>>>;

// Of the processes that run on this host; those with a checkpoint are added to `checkpoints`.
Commands ServerCommands(const ServerSetup& options, Checkpoints* checkpoints) {
  Commands commands;
  for (const std::string process : kServerProcesses) {
    if (!options.cluster.nats.empty() && IsVerifier(process)) {
      continue;
    }
    std::vector<std::string> argv = Command(process, options);
    const std::vector<std::string> checkpoint = checkpoints->ArgumentsOf(process);
    argv.insert(argv.end(), checkpoint.begin(), checkpoint.end());
    checkpoints->Add(process, argv);
    commands.emplace_back(process, std::move(argv));
  }
  return commands;
}

// Runs the server's processes until a signal comes, one is given up, or `continues` is false.
// Returns those given up.
std::vector<std::string> ServeOnce(const ServerSetup& options, const Commands& commands,
                                   const std::function<bool(KeptProcesses&)>& continues) {
  KeptProcesses kept(options.logs);
  AgentLines agents(options.logs / "agent_handler.txt");
  // The bridge starts first and ends last: only then may another host take the site.
  if (!options.cluster.nats.empty()) {
    Start(&kept, kBridge, BridgeCommand(BridgeRole::kCore, options.cluster, options.bus));
  }
  if (options.cluster.edges) {
    Start(&kept, kEdges, BridgeCommand(BridgeRole::kLink, options.cluster, options.link));
  }
  for (const auto& [process, argv] : commands) {
    Start(&kept, process, argv);
  }
  if (options.phone_port) {
    Start(&kept, kGateway, GatewayCommand(options));
  }
  Say(fmt::format("what they say is in {}; Ctrl-C ends them", fs::absolute(options.logs).string()));
  return KeepAlive(&kept, [&] {
    for (const std::string& line : agents.Take()) {
      Say(line);
    }
    return continues(kept);
  });
}

// A core's bridge ends by itself, without an error, when another host has the site.
bool HasLostSite(KeptProcesses& kept) {
  const auto exit = kept.Find(kBridge)->Poll();
  return exit && exit->code == 0;
}

}  // namespace

std::string ProgramOf(const std::string& process) {
  std::string name = "pangea-" + process;
  std::ranges::replace(name, '_', '-');
  return SiblingProgram(name);
}

void AddProcessOptions(const std::string& text, ServerSetup* options) {
  const size_t equals = text.find('=');
  const std::string process = text.substr(0, equals);
  if (equals == std::string::npos || !IsServerProcess(process)) {
    throw std::runtime_error(fmt::format("--options {}: give PROCESS=FILE, PROCESS one of {}", text,
                                         fmt::join(kServerProcesses, ", ")));
  }
  const fs::path file = text.substr(equals + 1);
  if (!fs::is_regular_file(file)) {
    throw std::runtime_error(fmt::format("--options {}: there is no file {}", text, file.string()));
  }
  options->options[process] = file;
}

void AddOptionsFolder(const fs::path& folder, ServerSetup* options) {
  if (!fs::is_directory(folder)) {
    throw std::runtime_error(
        fmt::format("--options-dir {}: there is no such folder", folder.string()));
  }
  for (const std::string process : kServerProcesses) {
    if (const fs::path file = folder / (process + ".yaml"); fs::exists(file)) {
      options->options[process] = file;
    }
  }
  SayUnusedOptions(folder);
}

int Serve(const ServerSetup& options) {
  InstallSignalHandlers();
  Say(ToString(LoadedBlas()));
  fs::create_directories(options.logs);
  const bool is_core = !options.cluster.nats.empty();
  Checkpoints checkpoints(options.checkpoints, options.journal, options.logs);
  const Commands commands = ServerCommands(options, &checkpoints);
  std::vector<std::string> given_up;
  for (bool serves = true; serves;) {
    if (is_core) {
      Say(fmt::format("stands by until this host has the site; see {}/bridge.txt",
                      fs::absolute(options.logs).string()));
      if (!StandBy(options.cluster, options.journal, options.logs, &checkpoints)) {
        return 0;
      }
    }
    bool lost_site = false;
    given_up = ServeOnce(options, commands, [&](KeptProcesses& kept) {
      checkpoints.Tick(SteadySeconds());
      lost_site = is_core && HasLostSite(kept);
      return !lost_site;
    });
    serves = lost_site;
  }
  for (const std::string& process : given_up) {
    if (checkpoints.Drop(process)) {
      Say(fmt::format("removed the checkpoint of {}: it starts from the journal next time",
                      process));
    }
  }
  Say("writes the checkpoints, so that the next start is quick; press Ctrl-C again to skip this");
  checkpoints.Finish();
  Say("ended");
  return given_up.empty() ? 0 : 1;
}

int ServeAsWorker(const ServerSetup& options) {
  InstallSignalHandlers();
  fs::create_directories(options.logs);
  KeptProcesses kept(options.logs);
  Start(&kept, kBridge, BridgeCommand(BridgeRole::kWorker, options.cluster, options.bus));
  for (const char* verifier : kVerifiers) {
    Start(&kept, verifier, Command(verifier, options));
  }
  Say(fmt::format("what they say is in {}; Ctrl-C ends them", fs::absolute(options.logs).string()));
  return KeepAlive(&kept, [] { return true; }).empty() ? 0 : 1;
}

}  // namespace pangea
