// pangea-server: runs all server processes with one command.

#include "server/command_line.h"

int main(int argc, char** argv) { return pangea::server::RunCommandLine(argc, argv); }
