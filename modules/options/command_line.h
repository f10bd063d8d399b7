#pragma once

#include <CLI/CLI.hpp>

namespace pangea {

// Parses the command line, which runs its subcommand (a callback of CLI11). What that throws
// becomes one line on stderr, behind the program's name. The exit code: 0, 1, or CLI11's (above
// 100).
int RunSubcommand(CLI::App& app, int argc, char** argv);

}  // namespace pangea
