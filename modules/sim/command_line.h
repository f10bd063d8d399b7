#pragma once

namespace pangea::sim {

// The whole of pangea-sim. Returns the exit code; an error is one line on stderr.
int RunCommandLine(int argc, char** argv);

}  // namespace pangea::sim
