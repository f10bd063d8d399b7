#pragma once

namespace pangea::vio {

// The whole of pangea-vio. Returns the exit code (see --help); an error is one line on stderr.
int RunCommandLine(int argc, char** argv);

}  // namespace pangea::vio
