// pangea-site: manages the maps of a server, each in its own folder.

#include "options/command_line.h"
#include "site/commands.h"

int main(int argc, char** argv) {
  CLI::App app("Makes, lists, backs up, merges, compacts, exports and deletes sites: named maps",
               "pangea-site");
  app.require_subcommand(1);
  app.footer(
      "Exit code: 0; 1 when something could not be done; 3 when something of a journal is lost (it "
      "is damaged): then all is of what could be read; above 100 for a wrong command line.");
  pangea::LogReadings readings;
  bool lost = false;
  pangea::site::AddCommands(app, &readings, &lost);
  const int exit_code =
      pangea::TellLosses("pangea-site", readings, pangea::RunSubcommand(app, argc, argv));
  return exit_code == 0 && lost ? pangea::kExitLost : exit_code;
}
