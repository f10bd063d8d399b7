// pangea-session: scripted multi-agent sessions, their deterministic replay, and reports.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <iostream>

#include "session/commands.h"

int main(int argc, char** argv) {
  CLI::App app("Plays recordings through agents and server, and replays what was captured",
               "pangea-session");
  app.require_subcommand(1);
  app.footer(
      "Exit code: 0; 1 when something could not be done; 2 when an expectation of the session file "
      "was missed or logs differ; above 100 for a wrong command line.");
  int exit_code = 0;
  pangea::session::AddRunCommand(app, &exit_code);
  pangea::session::AddListCommand(app);
  pangea::session::AddReplayCommand(app, &exit_code);
  pangea::session::AddReportCommand(app, &exit_code);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error);
  } catch (const std::exception& error) {
    std::cerr << fmt::format("pangea-session: {}\n", error.what());
    return 1;
  }
  return exit_code;
}
