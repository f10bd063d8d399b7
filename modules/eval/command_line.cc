#include "eval/command_line.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "eval/evaluate.h"
#include "files/csv.h"
#include "files/text_file.h"
#include "options/command_line.h"
#include "recording/euroc.h"

namespace pangea::eval {
namespace {

void Warn(const std::vector<std::string>& warnings) {
  for (const std::string& warning : warnings) {
    fmt::print(stderr, "warning: {}\n", warning);
  }
}

// Reads a TUM or EuRoC ground-truth file, or a recording's folder.
PosesOrPositions ReadReference(const std::string& path) {
  std::vector<std::string> warnings;
  PosesOrPositions reference = std::filesystem::is_directory(path)
                                   ? PosesOrPositions{ReadEurocGroundTruthOf(path, &warnings)}
                                   : ReadPosesOrPositions(path, &warnings);
  Warn(warnings);
  if (reference.trajectory.empty()) {
    throw std::runtime_error(fmt::format("{}: the recording has no ground truth", path));
  }
  return reference;
}

// CLI11's ranges accept "nan".
const CLI::Validator kLength(
    [](const std::string& text) -> std::string {
      double value = 0;
      return ParseNumber(text, &value) && value > 0 && value <= 1e9
                 ? ""
                 : fmt::format("'{}' is no number above 0, at most 1e9", text);
    },
    "POSITIVE");

constexpr const char* kStdout = "-";

// Prints the table and writes the JSON to its file; JSON on stdout replaces the table.
void Write(const std::string& table, const nlohmann::ordered_json& json, const std::string& path) {
  const std::string text = json.dump(2) + "\n";
  fmt::print("{}", path == kStdout ? text : table);
  if (!path.empty() && path != kStdout) {
    WriteTextFile(path, text);
  }
}

class CommandLine {
 public:
  // Adds its subcommands to `app`, which must outlive it. Call Run after parsing.
  explicit CommandLine(CLI::App& app);
  // Throws std::runtime_error with a one-line message for the user.
  void Run();

 private:
  void AddCommon(CLI::App& command);
  std::vector<EvaluationInput> ReadInputs() const;
  void RunAbsolute() const;
  void RunRelative() const;

  std::function<void()> chosen_;
  std::string estimate_, reference_;  // of ate and rpe
  std::vector<std::string> files_;    // estimate, reference, estimate, reference, ...
  double max_gap_s_ = 1e-6 * kMaxGroundTruthGapUs;
  std::string json_path_;
  std::string plot_prefix_;
  std::vector<double> distances_m_ = {1, 2, 5, 10, 20, 50};
  std::vector<double> durations_s_ = {1, 10};
};

CommandLine::CommandLine(CLI::App& app) {
  app.require_subcommand(1);
  CLI::App* ate = app.add_subcommand("ate", "absolute error of one trajectory");
  CLI::App* joint = app.add_subcommand(
      "joint", "absolute error of several agents' trajectories in one map: one alignment for all");
  CLI::App* rpe = app.add_subcommand("rpe", "relative error over stretches of path and of time");
  const std::string kinds =
      "TUM file or EuRoC ground-truth csv, for ate and joint also of positions alone (stamp x y z)";
  for (CLI::App* command : {ate, rpe}) {
    command->add_option("ESTIMATE", estimate_, "the trajectory to evaluate: " + kinds)->required();
    command
        ->add_option("REFERENCE", reference_,
                     "the ground truth: a recording's folder, or a file of these kinds")
        ->required();
  }
  joint
      ->add_option("ESTIMATE_REFERENCE", files_,
                   "of each agent ESTIMATE, then REFERENCE: " + kinds +
                       "; REFERENCE may be a recording's folder")
      ->required();
  for (CLI::App* command : {ate, joint, rpe}) {
    AddCommon(*command);
  }
  for (CLI::App* command : {ate, joint}) {
    command->add_option("--plot", plot_prefix_,
                        "write PREFIX.trajectory.png and PREFIX.error.png (SE(3) alignment)");
    command->callback([this] { chosen_ = [this] { RunAbsolute(); }; });
  }
  rpe->add_option("--distances", distances_m_, "metres of path")->delimiter(',')->check(kLength);
  rpe->add_option("--durations", durations_s_, "seconds")->delimiter(',')->check(kLength);
  rpe->callback([this] { chosen_ = [this] { RunRelative(); }; });
}

void CommandLine::AddCommon(CLI::App& command) {
  command
      .add_option("--max-gap", max_gap_s_,
                  "seconds between reference poses across which it is still interpolated")
      ->check(kLength)
      ->capture_default_str();
  command.add_option("--json", json_path_,
                     "write the metrics to this file; -: to stdout, in place of the table");
}

void CommandLine::Run() {
  if (files_.empty()) {
    files_ = {estimate_, reference_};
  }
  chosen_();
}

std::vector<EvaluationInput> CommandLine::ReadInputs() const {
  if (files_.size() % 2 != 0) {
    throw std::runtime_error("each ESTIMATE needs its REFERENCE behind it");
  }
  std::vector<EvaluationInput> inputs;
  for (size_t i = 0; i < files_.size(); i += 2) {
    if (std::filesystem::is_directory(files_[i])) {
      throw std::runtime_error(
          fmt::format("{}: is a folder: give ESTIMATE first, then REFERENCE", files_[i]));
    }
    std::vector<std::string> warnings;
    PosesOrPositions estimate = ReadPosesOrPositions(files_[i], &warnings);
    PosesOrPositions reference = ReadReference(files_[i + 1]);
    inputs.push_back({std::filesystem::path(files_[i]).filename().string(),
                      std::move(estimate.trajectory), std::move(reference.trajectory),
                      estimate.has_rotations && reference.has_rotations});
    Warn(warnings);
    Warn(SwappedWarnings(inputs.back()));
  }
  return inputs;
}

void CommandLine::RunAbsolute() const {
  const std::vector<EvaluationInput> inputs = ReadInputs();
  const AbsoluteEvaluation evaluation = EvaluateAbsolute(inputs, max_gap_s_);
  Write(ToText(evaluation), ToJson(evaluation), json_path_);
  if (!plot_prefix_.empty()) {
    const JointAte& se3 = evaluation.by_alignment.front().second;
    const std::string title = fmt::format("ATE {:.3f} m", se3.position_m.rmse);
    WritePng(TrajectoryPlot(title, inputs, se3.alignment), plot_prefix_ + ".trajectory.png");
    WritePng(ErrorPlot(title, inputs, se3), plot_prefix_ + ".error.png");
  }
}

void CommandLine::RunRelative() const {
  const std::vector<EvaluationInput> inputs = ReadInputs();
  const RelativeEvaluation evaluation =
      EvaluateRelative(inputs.front(), distances_m_, durations_s_, max_gap_s_);
  Write(ToText(evaluation), ToJson(evaluation), json_path_);
}

}  // namespace

int RunCommandLine(int argc, char** argv) {
  CLI::App app("Errors of trajectories against ground truth", "pangea-eval");
  AddVersion(app);
  CommandLine commands(app);
  CLI11_PARSE(app, argc, argv);
  try {
    commands.Run();
  } catch (const std::exception& error) {
    return Failed("pangea-eval", error);
  }
  return OutputIsWritten("pangea-eval") ? 0 : 1;
}

}  // namespace pangea::eval
