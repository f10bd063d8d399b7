#pragma once

namespace pangea::vio {

// pangea-vio, whole: returns the exit code (--help has them). What is wrong is said in one line on
// stderr.
int RunCommandLine(int argc, char** argv);

}  // namespace pangea::vio
