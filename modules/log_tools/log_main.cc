// pangea-log: what is in a captured log, parts of it, and what it amounts to in other formats.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <lcm/lcm-cpp.hpp>
#include <map>
#include <optional>

#include "log_tools/explain.h"
#include "log_tools/log_diff.h"
#include "log_tools/log_edit.h"
#include "log_tools/log_export.h"
#include "log_tools/log_import.h"
#include "log_tools/log_info.h"
#include "log_tools/recording_arguments.h"
#include "recording/text_file.h"
#include "report/session_record.h"

namespace pangea::session {
namespace {

struct Arguments {
  std::vector<std::string> logs;
  LogCut cut;
  std::string out, tum, g2o, ply;
  std::optional<int64_t> constraint;
  std::vector<std::string> recordings;  // ID=DIR
  bool fields = false, json = false;
  int exit_code = 0;
};

void Export(const Arguments& arguments) {
  const std::string& log = arguments.logs.front();
  if (arguments.tum.empty() && arguments.g2o.empty() && arguments.ply.empty()) {
    throw std::runtime_error("export: say what, one or more of --tum, --g2o, --ply");
  }
  if (!arguments.tum.empty()) {
    for (const std::string& file : ExportTum(log, arguments.tum)) {
      std::cout << file << "\n";
    }
  }
  if (!arguments.ply.empty()) {
    ExportPly(log, arguments.ply);
    std::cout << arguments.ply << "\n";
  }
  if (!arguments.g2o.empty()) {
    const NamedGraph named = GraphOf(log);
    std::string text = ToG2o(named.graph);
    for (size_t i = 0; i < named.keyframes.size(); ++i) {
      text += fmt::format("# {} is keyframe {}\n", i, ToString(named.keyframes[i]));
    }
    WriteTextFile(arguments.g2o, text);
    std::cout << fmt::format("{}: {} vertices, {} edges, cost {:.3f}\n", arguments.g2o,
                             named.graph.vertices.size(), named.graph.edges.size(),
                             Cost(named.graph));
  }
}

void ExplainResult(const Arguments& arguments) {
  const std::string& log = arguments.logs.front();
  if (!arguments.constraint) {
    std::cout << ListResults(log);
    return;
  }
  const Explanation explanation = Explain(log, *arguments.constraint);
  std::cout << ToText(explanation);
  if (!arguments.out.empty()) {
    std::map<int32_t, std::string> recordings = RecordingsById(arguments.recordings);
    recordings.merge(RecordingsAtHand(ReadSessionRecord({log})));
    WriteExplanationPng(explanation, recordings, arguments.out);
  }
}

// Of any file the LCM library reads nothing, and says nothing.
std::string HoldsEvents(const std::string& path) {
  lcm::LogFile log(path, "r");
  const bool any = log.good() && log.readNextEvent() != nullptr;
  return any ? "" : fmt::format("{}: holds no event; is it an LCM log?", path);
}

CLI::App* AddCommand(CLI::App& app, const char* name, const char* what, Arguments* arguments,
                     int num_logs) {
  CLI::App* command = app.add_subcommand(name, what);
  command->add_option("log", arguments->logs, "LCM log")
      ->required()
      ->expected(num_logs)
      ->check(CLI::ExistingFile)
      ->check(HoldsEvents);
  return command;
}

void AddCutOptions(CLI::App& command, Arguments* arguments) {
  command.add_option("--from", arguments->cut.from_s, "Seconds since the first event")
      ->capture_default_str();
  command.add_option("--to", arguments->cut.to_s,
                     "Seconds since the first event (default: the end)");
  command
      .add_option("--channels", arguments->cut.channels, "Regular expression for the whole name")
      ->capture_default_str();
}

}  // namespace

void AddCommands(CLI::App& app, Arguments* arguments) {
  AddCommand(app, "info", "Channels, keyframes and verification results in a log", arguments, 1)
      ->callback([arguments] {
        const std::string& log = arguments->logs.front();
        std::cout << ToText(Summarise(log), log);
      });
  CLI::App* list = AddCommand(app, "list", "The messages of a log, one a line", arguments, 1);
  AddCutOptions(*list, arguments);
  list->add_flag("--fields", arguments->fields, "Every field, of arrays the first eight items");
  list->add_flag("--json", arguments->json, "Every field, one JSON object a line");
  list->callback([arguments] {
    ListEvents(arguments->logs.front(), arguments->cut,
               arguments->json     ? ListAs::kJson
               : arguments->fields ? ListAs::kFields
                                   : ListAs::kLines,
               std::cout);
  });
  CLI::App* diff =
      AddCommand(app, "diff",
                 "Where two runs part: the first message of each channel that differs, "
                 "and its field; exit code 2 when one does",
                 arguments, 2);
  diff->callback([arguments] {
    const LogDiff differences = DiffLogs(arguments->logs[0], arguments->logs[1]);
    std::cout << ToText(differences);
    arguments->exit_code = differences.First() == nullptr ? 0 : 2;
  });
  CLI::App* cut = AddCommand(app, "cut", "A part of a log: a time, some channels", arguments, 1);
  AddCutOptions(*cut, arguments);
  cut->add_option("--out", arguments->out, "The new log")->required();
  cut->callback([arguments] {
    std::cout << fmt::format("{}: {} events\n", arguments->out,
                             CutLog(arguments->logs.front(), arguments->cut, arguments->out));
  });
  CLI::App* cat = AddCommand(app, "cat", "Several logs in one, by time of capture", arguments, -1);
  cat->alias("merge");
  cat->add_option("--out", arguments->out, "The new log")->required();
  cat->callback([arguments] {
    std::cout << fmt::format("{}: {} events\n", arguments->out,
                             MergeLogs(arguments->logs, arguments->out));
  });
  CLI::App* out = AddCommand(app, "export", "What a server bus' log amounts to", arguments, 1);
  out->add_option("--tum", arguments->tum, "Folder for the agents' trajectories, TUM format");
  out->add_option("--g2o", arguments->g2o, "File for the pose graph, g2o format");
  out->add_option("--ply", arguments->ply, "File for the largest group's map points");
  out->callback([arguments] { Export(*arguments); });
  CLI::App* back = AddCommand(app, "import",
                              "A pose graph that was exported and solved elsewhere, back into the "
                              "log: its poses are the newest state of each group",
                              arguments, 1);
  back->add_option("--g2o", arguments->g2o, "g2o file; vertices numbered as exported")
      ->required()
      ->check(CLI::ExistingFile);
  back->add_option("--out", arguments->out, "The new log")->required();
  back->callback([arguments] {
    const int64_t placed = ImportG2o(arguments->logs.front(), arguments->g2o, arguments->out);
    std::cout << fmt::format("{}: {} keyframes as in {}\n", arguments->out, placed, arguments->g2o);
  });
  CLI::App* explain = AddCommand(
      app, "explain", "Why a constraint was accepted or refused; without --constraint, all of them",
      arguments, 1);
  explain->add_option("--constraint", arguments->constraint, "Its id");
  explain->add_option("--out", arguments->out, "Picture (PNG) of both keyframes at each step");
  explain->add_option("--recording", arguments->recordings,
                      "ID=FOLDER: an agent's recording, for its images (default: as the session "
                      "remembers it beside its log)");
  explain->callback([arguments] { ExplainResult(*arguments); });
  CLI::App* cost = app.add_subcommand("cost", "The cost of a pose graph in g2o format");
  cost->add_option("graph", arguments->g2o, "g2o file")->required()->check(CLI::ExistingFile);
  cost->callback([arguments] {
    const Graph graph = ReadG2o(arguments->g2o);
    std::cout << fmt::format("{}: {} vertices, {} edges, cost {:.3f}\n", arguments->g2o,
                             graph.vertices.size(), graph.edges.size(), Cost(graph));
  });
}

}  // namespace pangea::session

int main(int argc, char** argv) {
  CLI::App app("What is in a captured LCM log, parts of it, and other formats", "pangea-log");
  app.require_subcommand(1);
  pangea::session::Arguments arguments;
  pangea::session::AddCommands(app, &arguments);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error);
  } catch (const std::exception& error) {
    std::cerr << fmt::format("pangea-log: {}\n", error.what());
    return 1;
  }
  return arguments.exit_code;
}
