#pragma once

namespace pangea::log_tools {

// The whole of pangea-log. Returns the exit code (see --help); an error is one line on stderr.
int RunCommandLine(int argc, char** argv);

}  // namespace pangea::log_tools
