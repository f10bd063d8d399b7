// pangea-site: the maps of a server, each in a folder of its own.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <iostream>

#include "site/commands.h"

int main(int argc, char** argv) {
  CLI::App app("Makes, lists, backs up, merges, compacts, exports and deletes sites: named maps",
               "pangea-site");
  app.require_subcommand(1);
  app.footer(
      "Exit code: 0; 1 when something could not be done; 3 when something of a journal is lost (it "
      "is damaged): then all is of what could be read; above 100 for a wrong command line.");
  pangea::LogReadings readings;
  pangea::site::AddCommands(app, &readings);
  int exit_code = 0;
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error);
  } catch (const std::exception& error) {
    std::cerr << fmt::format("pangea-site: {}\n", error.what());
    exit_code = 1;
  }
  return pangea::TellLosses("pangea-site", readings, exit_code);
}
