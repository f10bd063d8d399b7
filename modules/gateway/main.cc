// pangea-gateway: lets the browsers of phones join a site, over HTTPS and WebSockets.

#include <CLI/CLI.hpp>
#include <stdexcept>

#include "gateway/commands.h"
#include "options/command_line.h"

int main(int argc, char** argv) {
  CLI::App app(
      "Serves the phone's page, lets agents join by a code, and carries their link packets",
      "pangea-gateway");
  pangea::GatewayArguments arguments;
  pangea::AddGatewayCommands(app, &arguments);
  try {
    app.parse(argc, argv);
    if (!app.get_subcommands().empty()) {
      return 0;  // the subcommand has run while parsing
    }
    if (arguments.site.empty()) {
      throw std::runtime_error("give --site FOLDER");
    }
    pangea::RunGateway(arguments);
  } catch (const CLI::ParseError& error) {
    return app.exit(error);
  } catch (const std::exception& error) {
    return pangea::Failed("pangea-gateway", error);
  }
  return 0;
}
