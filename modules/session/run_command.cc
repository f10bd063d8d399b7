// The commands `run` and `list`.

#include "session/commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "blas/blas.h"
#include "options/command_line.h"
#include "session/out_folder.h"
#include "session/processes/player.h"
#include "session/run/session_runner.h"
#include "session/session_file/session_file.h"
#include "session/session_file/session_list.h"
#include "session/session_report.h"

namespace pangea::session {
namespace {

namespace fs = std::filesystem;

std::optional<fs::path> FolderOf(const std::string& recordings) {
  return recordings.empty() ? std::nullopt : std::make_optional<fs::path>(recordings);
}

struct RunArguments {
  std::string file;
  std::string out;
  std::string recordings;
  std::string rate = "1";
  std::string journal;
  int first_port = 0;
};

// The files and folders that a session begins, or continues where they are.
std::vector<std::string> NamesOf(const SessionScript& script) {
  std::vector<std::string> names{"keys", "journal.lcm"};
  for (const AgentScript& agent : script.agents) {
    names.push_back(fmt::format("agent_{}.lcm", agent.id));
    names.push_back(fmt::format("spool_{}", agent.id));
  }
  return names;
}

// The files and folders that a session reads, or continues.
std::vector<fs::path> NeededBy(const SessionScript& script, const std::string& journal) {
  std::vector<fs::path> needed{journal};
  for (const AgentScript& agent : script.agents) {
    needed.insert(needed.end(), {agent.resolved, agent.resolved_keyframes});
  }
  return needed;
}

int Run(const RunArguments& arguments, LogReadings* readings) {
  SessionScript script =
      ReadSessionFile(FindSessionFile(arguments.file), FolderOf(arguments.recordings));
  CheckRate(arguments.rate, script);
  PlaceDisconnects(arguments.rate, &script);
  std::ranges::for_each(script.agents, CheckRecording);
  RunOptions options;
  options.out = fs::path(arguments.out);
  options.rate = arguments.rate;
  options.journal =
      arguments.journal.empty() ? options.out / "journal.lcm" : fs::path(arguments.journal);
  if (arguments.first_port != 0) {
    options.first_port = static_cast<uint16_t>(arguments.first_port);
  }
  CheckNothingIsReplaced(options.out, NamesOf(script));
  CheckNothingNeededIsIn(options.out, NeededBy(script, arguments.journal));
  const OutFolder out(options.out);
  std::cout << ToString(LoadedBlas()) << std::endl;
  WriteRecordings(script, options.out);
  const RunSummary summary = RunSession(script, options);
  WriteTiming(summary.wall_s, options.out);
  // Print failures before the report, which may fail on a full disk.
  for (const std::string& failure : summary.failures) {
    std::cerr << fmt::format("pangea-session: {}\n", failure);
  }
  const int exit_code = PrintReport(ReportRun(script, summary, options.out, readings));
  return summary.failures.empty() ? exit_code : 1;
}

}  // namespace

void AddRunCommand(CLI::App& app, CommandResult* result) {
  auto arguments = std::make_shared<RunArguments>();
  CLI::App* run = app.add_subcommand("run", "Play a session file through real processes");
  run->add_option("file", arguments->file, "Session file (YAML), or the name of one in sessions/")
      ->required();
  run->add_option("--out", arguments->out, "Folder for everything the session leaves")->required();
  run->add_option("--recordings", arguments->recordings,
                  "Folder the recordings are relative to (default: the session file's)");
  run->add_option("--rate", arguments->rate,
                  "1 = as recorded, 2 = twice as fast, ..., max = as fast as everybody keeps up")
      ->check(Within(1e-3, 1e6) | CLI::IsMember({"max"}))
      ->capture_default_str();
  run->add_option("--journal", arguments->journal,
                  "The server's journal; one of an earlier session is continued (default: "
                  "journal.lcm in the folder)");
  run->add_option("--port", arguments->first_port,
                  "First UDP port of the session's buses (default: free ones are chosen)")
      ->check(CLI::Range(1024, 65000));
  run->callback([arguments, result] { result->exit_code = Run(*arguments, &result->readings); });
}

void AddListCommand(CLI::App& app) {
  struct Arguments {
    std::string folder = SessionFolder();
    std::string recordings;
    bool names = false;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* list =
      app.add_subcommand("list", "Session files: who is in them, and what they lack to be run");
  list->add_option("folder", arguments->folder, "Folder of session files, or one of them")
      ->check(CLI::ExistingPath)
      ->capture_default_str();
  list->add_option("--recordings", arguments->recordings,
                   "Folder the recordings are relative to (default: the session file's)");
  list->add_flag("--names", arguments->names, "Names only");
  list->callback([arguments] {
    const std::vector<fs::path> files = fs::is_regular_file(arguments->folder)
                                            ? std::vector<fs::path>{arguments->folder}
                                            : SessionFiles(arguments->folder);
    if (files.empty()) {
      throw std::runtime_error(
          fmt::format("{}: no session files here; name their folder", arguments->folder));
    }
    if (!arguments->names) {
      std::cout << DescribeSessions(files, FolderOf(arguments->recordings));
      return;
    }
    for (const fs::path& file : files) {
      std::cout << file.stem().string() << "\n";
    }
  });
}

}  // namespace pangea::session
