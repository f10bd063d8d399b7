#pragma once

// The command line of pangea-session.

#include <CLI/CLI.hpp>

namespace pangea::session {

// Adds `run`, `list`, `replay` and `report` to the app; whichever is given runs when the app has
// parsed. `exit_code` is set by it.
void AddRunCommand(CLI::App& app, int* exit_code);
void AddListCommand(CLI::App& app);
void AddReplayCommand(CLI::App& app, int* exit_code);
void AddReportCommand(CLI::App& app, int* exit_code);

}  // namespace pangea::session
