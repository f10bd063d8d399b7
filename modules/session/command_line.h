#pragma once

namespace pangea::session {

// The whole of pangea-session. Returns the exit code (see --help); an error is one line on stderr.
int RunCommandLine(int argc, char** argv);

}  // namespace pangea::session
