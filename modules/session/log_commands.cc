// The commands on captured logs: `replay`, `report`, `compare`.

#include "session/commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <limits>
#include <memory>
#include <stdexcept>

#include "blas/blas.h"
#include "bus/process.h"
#include "files/make_folder.h"
#include "files/progress.h"
#include "log_file/log_reader.h"
#include "log_tools/explain.h"
#include "log_tools/log_diff.h"
#include "log_tools/log_info.h"
#include "log_tools/recording_arguments.h"
#include "options/command_line.h"
#include "replay/replay.h"
#include "report/compare.h"
#include "report/session_record.h"
#include "session/out_folder.h"
#include "session/session_file/session_file.h"
#include "session/session_file/session_list.h"
#include "session/session_report.h"

namespace pangea::session {
namespace {

namespace fs = std::filesystem;

// Arguments of `replay` and `report`; the latter has only one log.
struct LogArguments {
  std::vector<std::string> logs;
  std::string out;
  std::vector<std::string> recordings;  // ID=DIR
  std::string expect;                   // a session file
};

// The command line takes precedence over the recorded session.
SessionRecord KnownOf(const LogArguments& arguments, LogReadings* readings) {
  SessionRecord known = ReadSessionRecord({arguments.logs.begin(), arguments.logs.end()});
  if (!arguments.expect.empty()) {
    known.expect = ParseSessionFile(FindSessionFile(arguments.expect)).expect;
  }
  for (const auto& [id, folder] : RecordingsOf(arguments.recordings, arguments.logs, readings)) {
    GiveRecording(id, folder, &known);
  }
  return known;
}

// A log given twice would be two walks of the same agents.
void CheckGivenOnce(const std::vector<std::string>& logs) {
  for (size_t i = 1; i < logs.size(); ++i) {
    for (size_t j = 0; j < i; ++j) {
      if (fs::equivalent(logs[i], logs[j])) {
        throw std::runtime_error(fmt::format("{}: is given twice: give each log once", logs[i]));
      }
    }
  }
}

struct ReplayArguments : LogArguments {
  std::string options;
  std::vector<std::string> set;
  double until_s = std::numeric_limits<double>::infinity();
  std::optional<double> checkpoint_s;
  std::vector<std::string> only;
  std::string diff;
  std::optional<int64_t> explain;
};

int PrintDiff(const std::string& a, const std::string& b, double until_s, LogReadings* readings) {
  const LogDiff diff = DiffLogs(a, b, until_s, readings);
  std::cout << fmt::format("first: {}, second: {}\n\n{}", a, b, ToText(diff)) << std::flush;
  return diff.First() == nullptr ? 0 : kMissed;
}

// The options of the logs, overridden by those of the command line; prints them.
ServerOptions OptionsOf(const ReplayArguments& arguments, LogReadings* readings) {
  LoggedOptions logged =
      ReadLoggedOptions({arguments.logs.begin(), arguments.logs.end()}, readings);
  Override(arguments.options, arguments.set, &logged.options);
  std::cout << ToString(LoadedBlas()) << "\n";
  for (const std::string& note : logged.notes) {
    std::cout << note << "\n";
  }
  for (const std::string& other : OtherThanDefault(logged.options)) {
    std::cout << fmt::format("option {}\n", other);
  }
  return logged.options;
}

// With --only or --from-checkpoint: messages of processes that do not run, or not yet, come from
// the log.
void RunReplayPart(const ReplayArguments& arguments, const ServerOptions& options,
                   const std::string& out_log, LogReadings* readings) {
  if (arguments.logs.size() != 1) {
    throw std::runtime_error(
        fmt::format("{}: takes one log, which has what is not to be retransmitted",
                    arguments.only.empty() ? "--from-checkpoint" : "--only"));
  }
  const std::string& log = arguments.logs.front();
  ReplayedPart part;
  part.until_s = arguments.until_s;
  if (!arguments.only.empty()) {
    part.processes = {arguments.only.begin(), arguments.only.end()};
  }
  part.checkpoint_s = arguments.checkpoint_s;
  part.options = options;
  int64_t taken_over = 0;
  {
    Progress progress("pangea-session");
    taken_over = ReplayPart(log, part, out_log, progress, readings);
  }
  if (arguments.checkpoint_s) {
    std::cout << fmt::format(
        "{} matches and verification results of the first {:g} s: taken from {}\n", taken_over,
        *arguments.checkpoint_s, log);
  }
}

ReplaySummary RunWholeReplay(const ReplayArguments& arguments, const ServerOptions& options,
                             const std::string& out_log, LogReadings* readings) {
  Progress progress("pangea-session");
  return Replay({arguments.logs.begin(), arguments.logs.end()}, options, arguments.until_s, out_log,
                progress, readings);
}

// Replays only some processes, and prints where their messages differ from those in the log.
int RunReplayOnly(const ReplayArguments& arguments, LogReadings* readings) {
  const std::string log = fs::path(arguments.out) / "session.lcm";
  const ServerOptions options = OptionsOf(arguments, readings);
  const OutFolder out(arguments.out);
  RunReplayPart(arguments, options, log, readings);
  return PrintDiff(arguments.diff.empty() ? arguments.logs.front() : arguments.diff, log,
                   arguments.until_s, readings);
}

void ExplainInto(const fs::path& out, int64_t constraint, const SessionRecord& known,
                 LogReadings* readings) {
  const Explanation explanation = Explain(out / "session.lcm", constraint, readings);
  const fs::path picture = out / fmt::format("constraint_{}.png", constraint);
  WriteExplanationPng(explanation, known, picture);
  std::cout << fmt::format("{}{}\n", ToText(explanation), picture.string());
}

// What is asked after a replay, which may take hours, is checked before it.
void CheckQuestions(const ReplayArguments& arguments, LogReadings* readings) {
  if (arguments.explain) {
    CheckConstraintId(arguments.logs, *arguments.explain, readings);
  }
  if (!arguments.diff.empty()) {
    LogReader(arguments.diff).Next();  // throws if it is not a log
  }
}

bool IsIn(const fs::path& file, const fs::path& folder) {
  return fs::exists(folder) && fs::equivalent(fs::absolute(file).parent_path(), folder);
}

int RunReplay(const ReplayArguments& arguments, LogReadings* readings) {
  const fs::path out(arguments.out);
  for (const std::string& log : arguments.logs) {
    if (IsIn(log, out)) {
      throw std::runtime_error(fmt::format(
          "--out {}: holds the log that is to be replayed; give another folder", arguments.out));
    }
  }
  if (!arguments.diff.empty() && IsIn(arguments.diff, out)) {
    throw std::runtime_error(
        fmt::format("--out {}: holds the log of --diff, which would be moved aside; give another "
                    "folder",
                    arguments.out));
  }
  CheckQuestions(arguments, readings);
  if (!arguments.only.empty()) {
    return RunReplayOnly(arguments, readings);
  }
  CheckGivenOnce(arguments.logs);
  const SessionRecord known = KnownOf(arguments, readings);
  const ServerOptions options = OptionsOf(arguments, readings);
  const OutFolder folder(out);
  const double begin_s = SteadySeconds();
  if (arguments.checkpoint_s) {
    RunReplayPart(arguments, options, out / "session.lcm", readings);
  } else {
    const ReplaySummary summary = RunWholeReplay(arguments, options, out / "session.lcm", readings);
    std::cout << fmt::format("replayed {} keyframes of {} agents\n", summary.keyframes,
                             summary.agent_ids.size());
  }
  WriteTiming(SteadySeconds() - begin_s, out);
  int exit_code = PrintReport(ReportLog(out / "session.lcm", known, out, readings));
  if (arguments.explain) {
    ExplainInto(out, *arguments.explain, known, readings);
  }
  if (!arguments.diff.empty()) {
    exit_code = std::max(
        exit_code, PrintDiff(arguments.diff, out / "session.lcm", arguments.until_s, readings));
  }
  return exit_code;
}

int RunReport(const LogArguments& arguments, LogReadings* readings) {
  if (fs::exists(fs::path(arguments.out) / "session.lcm")) {
    throw std::runtime_error(fmt::format(
        "--out {}: holds a session and its own report; give another folder", arguments.out));
  }
  if (AgentsIn(arguments.logs, readings).empty()) {
    throw std::runtime_error(
        fmt::format("{}: no KEYFRAME_* and no POSE_* in this log; give that of a server's bus: "
                    "session.lcm, journal.lcm",
                    arguments.logs.front()));
  }
  const SessionRecord known = KnownOf(arguments, readings);
  MakeFolder(arguments.out);
  return PrintReport(ReportLog(arguments.logs.front(), known, arguments.out, readings));
}

void AddResultOptions(CLI::App& command, LogArguments* arguments) {
  command.add_option("--out", arguments->out, "Folder for the results")->required();
  command.add_option(
      "--recording", arguments->recordings,
      "ID=FOLDER: an agent's recording, for its ground truth (default: as the session "
      "remembers it beside its log)");
  command.add_option(
      "--expect", arguments->expect,
      "Session file, or name of one in sessions/, whose 'expect' is checked (default: "
      "what the session remembers)");
}

void AddServerOptions(CLI::App& replay, ReplayArguments* arguments) {
  replay
      .add_option("--options", arguments->options,
                  "YAML file of options by process (fusion: {alignment: {min_inliers: 20}}), over "
                  "those of the log")
      ->check(CLI::ExistingFile);
  replay
      .add_option("--set", arguments->set,
                  "process.key=value, e.g. fusion.alignment.min_inliers=20; over --options; may "
                  "be given several times")
      ->allow_extra_args(false);
  replay
      .add_option("--until", arguments->until_s,
                  "Only the first so many seconds of the log (default: all of it)")
      ->check(Positive());
  replay
      .add_option("--from-checkpoint", arguments->checkpoint_s,
                  "The matches and verification results of the first so many seconds are taken "
                  "from the log, not made again")
      ->check(Positive());
}

// What is asked of the replay besides its report.
void AddQuestions(CLI::App& replay, ReplayArguments* arguments) {
  replay
      .add_option("--only", arguments->only,
                  "These processes alone (a,b,...), fed with what the others said in the log, and "
                  "where their messages differ from those in the log; no report")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::IsMember(std::vector<std::string>(std::begin(kReplayed), std::end(kReplayed))));
  replay
      .add_option("--diff", arguments->diff,
                  "Another log: where the replay parts from it (exit code 2 when it does)")
      ->check(CLI::ExistingFile);
  replay.add_option(
      "--explain", arguments->explain,
      "A constraint's id: why it was accepted or refused, as text, and as a picture in "
      "the folder");
  for (const char* of_the_report : {"--recording", "--expect", "--explain"}) {
    replay.get_option("--only")->excludes(replay.get_option(of_the_report));
  }
}

// A session's folder stands for the log that it holds.
CLI::Validator LogOfFolder() {
  return {[](std::string& path) {
            if (std::filesystem::is_directory(path)) {
              path = (std::filesystem::path(path) / "session.lcm").string();
            }
            return std::string();
          },
          ""};
}

}  // namespace

void AddReplayCommand(CLI::App& app, CommandResult* result) {
  auto arguments = std::make_shared<ReplayArguments>();
  CLI::App* replay = app.add_subcommand(
      "replay", "Run the server over the keyframes of captured logs, deterministically");
  replay
      ->add_option("logs", arguments->logs,
                   "session.lcm or journal.lcm of a session, its folder, or logs of pangea-vio "
                   "--out-keyframes; several are "
                   "interleaved as if they had started together")
      ->required()
      ->transform(LogOfFolder())
      ->check(CLI::ExistingFile);
  AddResultOptions(*replay, arguments.get());
  AddServerOptions(*replay, arguments.get());
  AddQuestions(*replay, arguments.get());
  replay->callback(
      [arguments, result] { result->exit_code = RunReplay(*arguments, &result->readings); });
}

void AddReportCommand(CLI::App& app, CommandResult* result) {
  auto arguments = std::make_shared<LogArguments>();
  CLI::App* report = app.add_subcommand(
      "report", "The report of a captured server bus, e.g. of a live server: nothing is run again");
  report
      ->add_option("log", arguments->logs,
                   "Log of a server bus, e.g. an lcm-logger's, or a session's folder")
      ->required()
      ->expected(1)
      ->transform(LogOfFolder())
      ->check(CLI::ExistingFile);
  AddResultOptions(*report, arguments.get());
  report->callback(
      [arguments, result] { result->exit_code = RunReport(*arguments, &result->readings); });
}

void AddCompareCommand(CLI::App& app) {
  auto runs = std::make_shared<std::vector<std::string>>();
  CLI::App* compare =
      app.add_subcommand("compare", "Reports of several runs side by side, a row each");
  compare->add_option("runs", *runs, "Folders of run, replay or report")
      ->required()
      ->check(CLI::ExistingPath);
  compare->callback([runs] { std::cout << CompareRuns({runs->begin(), runs->end()}); });
}

}  // namespace pangea::session
