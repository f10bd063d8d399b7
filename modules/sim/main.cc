// pangea-sim: renders recordings in EuRoC's format, with exact ground truth.

#include <CLI/CLI.hpp>
#include <exception>

#include "options/command_line.h"
#include "sim/command_line.h"

int main(int argc, char** argv) {
  CLI::App app("Renders a visual-inertial recording in EuRoC's format, with exact ground truth");
  pangea::sim::CommandLine command(app);
  CLI11_PARSE(app, argc, argv);
  try {
    command.Run();
  } catch (const std::exception& error) {
    return pangea::Failed("pangea-sim", error);
  }
  return 0;
}
