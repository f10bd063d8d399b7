#pragma once

namespace pangea::eval {

// The whole of pangea-eval. Returns the exit code; an error is one line on stderr.
int RunCommandLine(int argc, char** argv);

}  // namespace pangea::eval
