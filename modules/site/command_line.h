#pragma once

namespace pangea::site {

// The whole of pangea-site. Returns the exit code (see --help); an error is one line on stderr.
int RunCommandLine(int argc, char** argv);

}  // namespace pangea::site
