#include "session/command_line.h"

#include "options/command_line.h"
#include "session/commands.h"

namespace pangea::session {

int RunCommandLine(int argc, char** argv) {
  CLI::App app("Plays recordings through agents and server, and replays what was captured",
               "pangea-session");
  AddVersion(app);
  app.require_subcommand(1);
  app.footer(
      "Exit code: 0; 1 when something could not be done; 2 when an expectation of the session file "
      "was missed or logs differ; 3 when a log is damaged or ends in the middle of an event: the "
      "results are of the part that could be read; above 100 for a wrong command line.");
  CommandResult result;
  AddRunCommand(app, &result);
  AddListCommand(app);
  AddReplayCommand(app, &result);
  AddReportCommand(app, &result);
  AddCompareCommand(app);
  const int failed = RunSubcommand(app, argc, argv);
  return TellLosses("pangea-session", result.readings, failed != 0 ? failed : result.exit_code);
}

}  // namespace pangea::session
