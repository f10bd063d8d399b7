// pangea-session: scripted multi-agent sessions, their deterministic replay, and reports.

#include "session/command_line.h"

int main(int argc, char** argv) { return pangea::session::RunCommandLine(argc, argv); }
