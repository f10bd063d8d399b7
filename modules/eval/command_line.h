#pragma once

// The commands of pangea-eval: ate, joint, rpe.

#include <functional>
#include <string>
#include <vector>

#include "eval/evaluate.h"

namespace CLI {
class App;
}

namespace pangea {

class EvalCommandLine {
 public:
  // Adds its subcommands to `app`, which must outlive it. Call Run after parsing.
  explicit EvalCommandLine(CLI::App& app);
  // Throws std::runtime_error with a one-line message for the user.
  void Run();

 private:
  void AddCommon(CLI::App& command);
  std::vector<EvaluationInput> ReadInputs() const;
  void RunAbsolute() const;
  void RunRelative() const;

  std::function<void()> chosen_;
  std::vector<std::string> files_;  // estimate, reference, estimate, reference, ...
  double max_gap_s_ = 1e-6 * kMaxGroundTruthGapUs;
  std::string json_path_;
  std::string plot_prefix_;
  std::vector<double> distances_m_ = {1, 2, 5, 10, 20, 50};
  std::vector<double> durations_s_ = {1, 10};
};

}  // namespace pangea
