#pragma once

// The command line of pangea-session.

#include <CLI/CLI.hpp>

#include "log_file/log_reading.h"

namespace pangea::session {

struct CommandResult {
  int exit_code = 0;
  LogReadings readings;  // of the logs it read
};

// Adds `run`, `list`, `replay`, `report` and `compare` to the app; whichever is given runs when the
// app has parsed, and sets `result`.
void AddRunCommand(CLI::App& app, CommandResult* result);
void AddListCommand(CLI::App& app);
void AddReplayCommand(CLI::App& app, CommandResult* result);
void AddReportCommand(CLI::App& app, CommandResult* result);
void AddCompareCommand(CLI::App& app);

}  // namespace pangea::session
