#pragma once

namespace pangea::server {

// The whole of pangea-server. Returns the exit code; an error is one line on stderr.
int RunCommandLine(int argc, char** argv);

}  // namespace pangea::server
