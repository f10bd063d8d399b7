#pragma once

// The commands of pangea-session.

#include <CLI/CLI.hpp>

#include "log_file/log_reading.h"

namespace pangea::session {

struct CommandResult {
  int exit_code = 0;
  LogReadings readings;  // damage in the logs that were read
};

// Add the commands `run`, `list`, `replay`, `report` and `compare` to the app. The given command
// runs during parsing, and sets `result`.
void AddRunCommand(CLI::App& app, CommandResult* result);
void AddListCommand(CLI::App& app);
void AddReplayCommand(CLI::App& app, CommandResult* result);
void AddReportCommand(CLI::App& app, CommandResult* result);
void AddCompareCommand(CLI::App& app);

}  // namespace pangea::session
