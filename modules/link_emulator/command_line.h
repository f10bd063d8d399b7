#pragma once

namespace pangea::link_emulator {

// The whole of pangea-link-emulator. Returns the exit code; an error is one line on stderr.
int RunCommandLine(int argc, char** argv);

}  // namespace pangea::link_emulator
