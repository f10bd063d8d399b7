#pragma once

// The command line of pangea-site.

#include <CLI/CLI.hpp>

#include "log_file/log_reading.h"

namespace pangea::site {

// Adds the sub-commands to the app; the given one runs during parsing. `readings`: receives the
// damage of the logs that were read. `lost`: set to true after damage that the command itself told.
void AddCommands(CLI::App& app, LogReadings* readings, bool* lost);

}  // namespace pangea::site
