#pragma once

namespace pangea::uplink {

// The whole of pangea-uplink. Returns the exit code; an error is one line on stderr.
int RunCommandLine(int argc, char** argv);

}  // namespace pangea::uplink
