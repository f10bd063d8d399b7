#pragma once

// The command line of pangea-site.

#include <CLI/CLI.hpp>

#include "log_file/log_reading.h"

namespace pangea::site {

// Adds the sub-commands to the app; the one that is given runs when the app has parsed. `readings`:
// of the logs that were read and are not whole.
void AddCommands(CLI::App& app, LogReadings* readings);

}  // namespace pangea::site
