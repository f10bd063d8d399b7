#pragma once

namespace pangea::replay {

// The whole of pangea-keyframe-player. Returns the exit code (see --help); an error is one line on
// stderr.
int RunCommandLine(int argc, char** argv);

}  // namespace pangea::replay
