#pragma once

namespace pangea::viewer {

// The whole of pangea-viewer. Returns the exit code (see --help); an error is one line on stderr.
int RunCommandLine(int argc, char** argv);

}  // namespace pangea::viewer
