#pragma once

namespace pangea::gateway {

// The whole of pangea-gateway. Returns the exit code; an error is one line on stderr.
int RunCommandLine(int argc, char** argv);

}  // namespace pangea::gateway
