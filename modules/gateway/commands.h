#pragma once

// The command line of pangea-gateway.

#include <CLI/CLI.hpp>

#include "gateway/run_gateway.h"

namespace pangea {

// Adds the options of the gateway itself, and its subcommands, which run when the app parses them.
void AddGatewayCommands(CLI::App& app, GatewayArguments* arguments);

}  // namespace pangea
