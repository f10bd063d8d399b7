// pangea-eval: errors of estimated trajectories against ground truth.

#include <CLI/CLI.hpp>
#include <exception>

#include "eval/command_line.h"
#include "options/command_line.h"

int main(int argc, char** argv) {
  CLI::App app("Errors of trajectories against ground truth");
  pangea::EvalCommandLine commands(app);
  CLI11_PARSE(app, argc, argv);
  try {
    commands.Run();
  } catch (const std::exception& error) {
    return pangea::Failed("pangea-eval", error);
  }
  return pangea::OutputIsWritten("pangea-eval") ? 0 : 1;
}
