#pragma once

namespace pangea::agent_handler {

// The whole of pangea-agent-handler. Returns the exit code; an error is one line on stderr.
int RunCommandLine(int argc, char** argv);

}  // namespace pangea::agent_handler
