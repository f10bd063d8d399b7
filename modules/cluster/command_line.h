#pragma once

namespace pangea::cluster {

// The whole of pangea-bridge. Returns the exit code; an error is one line on stderr.
int RunCommandLine(int argc, char** argv);

}  // namespace pangea::cluster
