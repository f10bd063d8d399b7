#include "log_tools/command_line.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <map>
#include <optional>

#include "files/text_file.h"
#include "g2o/g2o.h"
#include "g2o/graph_solver.h"
#include "log_tools/anchors_gltf.h"
#include "log_tools/explain.h"
#include "log_tools/log_anchors.h"
#include "log_tools/log_diff.h"
#include "log_tools/log_edit.h"
#include "log_tools/log_export.h"
#include "log_tools/log_import.h"
#include "log_tools/log_info.h"
#include "log_tools/recording_arguments.h"
#include "options/command_line.h"
#include "report/session_record.h"

namespace pangea::log_tools {
namespace {

struct Arguments {
  std::vector<std::string> logs;
  LogCut cut;
  std::string out, tum, g2o, ply;
  std::optional<int64_t> constraint;
  std::vector<std::string> recordings;  // ID=DIR
  bool fields = false, json = false;
  int exit_code = 0;
  LogReadings readings;  // damage in the logs that were read
};

// An output that is written again is usual; the log itself would be lost.
void CheckIsNotTheLog(const std::string& out, const std::string& log) {
  std::error_code is_not_there;
  if (!out.empty() && std::filesystem::equivalent(out, log, is_not_there)) {
    throw std::runtime_error(fmt::format("{}: is the log that is read; give another name", out));
  }
}

void Export(Arguments& arguments) {
  const std::string& log = arguments.logs.front();
  CheckIsNotTheLog(arguments.ply, log);
  CheckIsNotTheLog(arguments.g2o, log);
  if (arguments.tum.empty() && arguments.g2o.empty() && arguments.ply.empty()) {
    throw std::runtime_error("export: say what, one or more of --tum, --g2o, --ply");
  }
  if (const std::string remark = RemarkOnExport(log, &arguments.readings); !remark.empty()) {
    std::cerr << fmt::format("pangea-log: {}\n", remark);
  }
  if (!arguments.tum.empty()) {
    for (const std::string& file : ExportTum(log, arguments.tum, &arguments.readings)) {
      std::cout << file << "\n";
    }
  }
  if (!arguments.ply.empty()) {
    ExportPly(log, arguments.ply, &arguments.readings);
    std::cout << arguments.ply << "\n";
  }
  if (!arguments.g2o.empty()) {
    const NamedGraph named = GraphOf(log, &arguments.readings);
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

void ExplainResult(Arguments& arguments) {
  const std::string& log = arguments.logs.front();
  CheckIsNotTheLog(arguments.out, log);
  if (!arguments.constraint) {
    std::cout << ListResults(log, &arguments.readings);
    return;
  }
  const std::map<int32_t, std::string> given = RecordingsById(arguments.recordings);
  const Explanation explanation = Explain(log, *arguments.constraint, &arguments.readings);
  std::cout << ToText(explanation);
  if (!arguments.out.empty()) {
    SessionRecord recordings = ReadSessionRecord({log});
    for (const auto& [id, folder] : given) {
      GiveRecording(id, folder, &recordings);
    }
    WriteExplanationPng(explanation, recordings, arguments.out);
  }
}

void ListAnchors(Arguments& arguments) {
  const std::string& log = arguments.logs.front();
  const LoggedAnchors logged = ReadAnchors(log, &arguments.readings);
  if (arguments.out.empty()) {
    std::cout << ToText(logged, log);
    return;
  }
  CheckIsNotTheLog(arguments.out, log);
  if (arguments.out.ends_with(".json")) {
    WriteTextFile(arguments.out, ToJson(logged));
  } else {
    ExportGltf(log, logged, arguments.out, &arguments.readings);
  }
  std::cout << fmt::format("{}: {} anchors\n", arguments.out, logged.anchors.size());
}

std::string IsJsonOrGltf(const std::string& path) {
  return path.ends_with(".json") || path.ends_with(".gltf")
             ? ""
             : fmt::format("{}: ends neither in .json nor in .gltf", path);
}

// The log's reader refuses a file that is not a log, and a pipe, which has no size.
std::string IsNotEmpty(const std::string& path) {
  std::error_code has_no_size;
  return std::filesystem::file_size(path, has_no_size) > 0 || has_no_size
             ? ""
             : fmt::format("{}: is empty: no event in it", path);
}

CLI::App* AddCommand(CLI::App& app, const char* name, const char* what, Arguments* arguments,
                     int num_logs) {
  CLI::App* command = app.add_subcommand(name, what);
  command->add_option("log", arguments->logs, "LCM log")
      ->required()
      ->expected(num_logs)
      ->check(CLI::ExistingFile)
      ->check(IsNotEmpty);
  return command;
}

void AddCutOptions(CLI::App& command, Arguments* arguments) {
  command.add_option("--from", arguments->cut.from_s, "Seconds since the first event")
      ->check(NotNegative())
      ->capture_default_str();
  command
      .add_option("--to", arguments->cut.to_s, "Seconds since the first event (default: the end)")
      ->check(Positive());
  command
      .add_option("--channels", arguments->cut.channels, "Regular expression for the whole name")
      ->capture_default_str();
}

void AddInfo(CLI::App& app, Arguments* arguments) {
  AddCommand(app, "info", "Channels, keyframes and verification results in a log", arguments, 1)
      ->callback([arguments] {
        const std::string& log = arguments->logs.front();
        const LogSummary summary = Summarise(log);
        arguments->readings[log] = summary.reading;
        std::cout << ToText(summary, log);
      });
}

void AddList(CLI::App& app, Arguments* arguments) {
  CLI::App* list = AddCommand(app, "list", "The messages of a log, one a line", arguments, 1);
  AddCutOptions(*list, arguments);
  list->add_flag("--fields", arguments->fields, "Every field, of arrays the first eight items");
  list->add_flag("--json", arguments->json, "Every field, one JSON object a line");
  list->callback([arguments] {
    ListEvents(arguments->logs.front(), arguments->cut,
               arguments->json     ? ListAs::kJson
               : arguments->fields ? ListAs::kFields
                                   : ListAs::kLines,
               std::cout, &arguments->readings);
  });
}

void AddAnchors(CLI::App& app, Arguments* arguments) {
  CLI::App* anchors = AddCommand(
      app, "anchors", "The anchors as the log ends: where they are, who made them", arguments, 1);
  anchors
      ->add_option("--out", arguments->out,
                   "FILE.json: every field; FILE.gltf: with the map points, glTF 2.0, y up")
      ->check(IsJsonOrGltf);
  anchors->callback([arguments] { ListAnchors(*arguments); });
}

void AddDiff(CLI::App& app, Arguments* arguments) {
  CLI::App* diff =
      AddCommand(app, "diff",
                 "Where two runs part: the first message of each channel that differs, "
                 "and its field; exit code 2 when one does",
                 arguments, 2);
  diff->callback([arguments] {
    const LogDiff differences =
        DiffLogs(arguments->logs[0], arguments->logs[1], std::numeric_limits<double>::infinity(),
                 &arguments->readings);
    std::cout << ToText(differences);
    arguments->exit_code = differences.First() == nullptr ? 0 : 2;
  });
}

void AddCut(CLI::App& app, Arguments* arguments) {
  CLI::App* cut =
      AddCommand(app, "cut",
                 "A part of a log: a time, some channels; of a damaged log all that can be "
                 "read, as a whole one",
                 arguments, 1);
  AddCutOptions(*cut, arguments);
  cut->add_option("--out", arguments->out, "The new log")->required();
  cut->callback([arguments] {
    const std::string& log = arguments->logs.front();
    const int64_t events = CutLog(log, arguments->cut, arguments->out, &arguments->readings);
    KeepRecordings({log}, arguments->out);
    std::cout << fmt::format("{}: {} events\n", arguments->out, events);
  });
}

void AddCat(CLI::App& app, Arguments* arguments) {
  CLI::App* cat = AddCommand(app, "cat", "Several logs in one, by time of capture", arguments, -1);
  cat->alias("merge");
  cat->add_option("--out", arguments->out, "The new log")->required();
  cat->callback([arguments] {
    const int64_t events = MergeLogs(arguments->logs, arguments->out, &arguments->readings);
    KeepRecordings({arguments->logs.begin(), arguments->logs.end()}, arguments->out);
    std::cout << fmt::format("{}: {} events\n", arguments->out, events);
  });
}

void AddExport(CLI::App& app, Arguments* arguments) {
  CLI::App* out = AddCommand(app, "export", "What a server bus' log amounts to", arguments, 1);
  out->add_option("--tum", arguments->tum, "Folder for the agents' trajectories, TUM format");
  out->add_option("--g2o", arguments->g2o, "File for the pose graph, g2o format");
  out->add_option("--ply", arguments->ply, "File for the largest group's map points");
  out->callback([arguments] { Export(*arguments); });
}

void AddImport(CLI::App& app, Arguments* arguments) {
  CLI::App* back = AddCommand(app, "import",
                              "A pose graph that was exported and solved elsewhere, back into the "
                              "log: its poses, not its edges, are the newest state of each group",
                              arguments, 1);
  back->add_option("--g2o", arguments->g2o, "g2o file; vertices numbered as exported")
      ->required()
      ->check(CLI::ExistingFile);
  back->add_option("--out", arguments->out, "The new log")->required();
  back->callback([arguments] {
    const std::string& log = arguments->logs.front();
    const ImportedG2o imported =
        ImportG2o(log, arguments->g2o, arguments->out, &arguments->readings);
    KeepRecordings({log}, arguments->out);
    for (const std::string& remark : imported.poses.remarks) {
      std::cerr << fmt::format("pangea-log: {}\n", remark);
    }
    std::cout << fmt::format(
        "{}: {} keyframes as in {}, whose edges are not taken: the log keeps its own; their cost "
        "was {:.3f} and is {:.3f}\n",
        arguments->out, imported.keyframes, arguments->g2o, imported.poses.cost_before,
        imported.poses.cost_after);
  });
}

void AddExplain(CLI::App& app, Arguments* arguments) {
  CLI::App* explain = AddCommand(
      app, "explain", "Why a constraint was accepted or refused; without --constraint, all of them",
      arguments, 1);
  explain->add_option("--constraint", arguments->constraint, "Its id");
  explain->add_option("--out", arguments->out, "Picture (PNG) of both keyframes at each step")
      ->needs("--constraint");
  explain->add_option("--recording", arguments->recordings,
                      "ID=FOLDER: an agent's recording, for its images (default: as the session "
                      "remembers it beside its log)");
  explain->callback([arguments] { ExplainResult(*arguments); });
}

Graph ReadGraph(const std::string& path) {
  Graph graph = ReadG2o(path);
  if (graph.vertices.empty()) {
    throw std::runtime_error(
        fmt::format("{}: has no VERTEX_SE3:QUAT: no pose graph in g2o format", path));
  }
  return graph;
}

void AddCost(CLI::App& app, Arguments* arguments) {
  CLI::App* cost = app.add_subcommand("cost", "The cost of a pose graph in g2o format");
  cost->add_option("graph", arguments->g2o, "g2o file")->required()->check(CLI::ExistingFile);
  cost->callback([arguments] {
    const Graph graph = ReadGraph(arguments->g2o);
    std::cout << fmt::format("{}: {} vertices, {} edges, cost {:.3f}\n", arguments->g2o,
                             graph.vertices.size(), graph.edges.size(), Cost(graph));
  });
}

void AddSolve(CLI::App& app, Arguments* arguments) {
  CLI::App* solve = app.add_subcommand(
      "solve",
      "Moves the vertices of a pose graph in g2o format to the lowest cost, in all six degrees of "
      "freedom. Vertices with FIX stay, else the first of each connected part");
  solve->add_option("graph", arguments->g2o, "g2o file")->required()->check(CLI::ExistingFile);
  solve->add_option("--out", arguments->out, "The solved graph, g2o format")->required();
  solve->callback([arguments] {
    CheckIsNotTheLog(arguments->out, arguments->g2o);
    Graph graph = ReadGraph(arguments->g2o);
    const GraphSolution solution = SolveGraph(&graph);
    WriteTextFile(arguments->out, ToG2o(graph));
    std::cout << fmt::format(
        "{}: {} vertices, {} edges, cost {:.3f} -> {:.3f} after {} iterations{}{}\n",
        arguments->out, graph.vertices.size(), graph.edges.size(), solution.cost_at_start,
        solution.cost, solution.iterations, solution.averaged ? ", from averaged rotations" : "",
        solution.converged ? "" : "; NOT CONVERGED");
    arguments->exit_code = solution.converged ? 0 : 1;
  });
}

void AddCommands(CLI::App& app, Arguments* arguments) {
  for (const auto add : {AddInfo, AddList, AddAnchors, AddDiff, AddCut, AddCat, AddExport,
                         AddImport, AddExplain, AddCost, AddSolve}) {
    add(app, arguments);
  }
}

}  // namespace

int RunCommandLine(int argc, char** argv) {
  CLI::App app("What is in a captured LCM log, parts of it, and other formats", "pangea-log");
  AddVersion(app);
  app.require_subcommand(1);
  app.footer(
      "Exit code: 0; 1 when something could not be done; 2 when logs differ; 3 when a log is "
      "damaged or ends in the middle of an event: the results are of the part that could be read; "
      "above 100 for a wrong command line.");
  Arguments arguments;
  AddCommands(app, &arguments);
  const int failed = RunSubcommand(app, argc, argv);
  return TellLosses("pangea-log", arguments.readings, failed != 0 ? failed : arguments.exit_code);
}

}  // namespace pangea::log_tools
