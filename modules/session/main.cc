// pangea-session: scripted multi-agent sessions, their deterministic replay, and reports.

#include "options/command_line.h"
#include "session/commands.h"

int main(int argc, char** argv) {
  CLI::App app("Plays recordings through agents and server, and replays what was captured",
               "pangea-session");
  app.require_subcommand(1);
  app.footer(
      "Exit code: 0; 1 when something could not be done; 2 when an expectation of the session file "
      "was missed or logs differ; 3 when something of a log is lost (it is damaged, or ends in the "
      "middle of an event): then all is of what could be read; above 100 for a wrong command "
      "line.");
  pangea::session::CommandResult result;
  pangea::session::AddRunCommand(app, &result);
  pangea::session::AddListCommand(app);
  pangea::session::AddReplayCommand(app, &result);
  pangea::session::AddReportCommand(app, &result);
  pangea::session::AddCompareCommand(app);
  const int failed = pangea::RunSubcommand(app, argc, argv);
  return pangea::TellLosses("pangea-session", result.readings,
                            failed != 0 ? failed : result.exit_code);
}
