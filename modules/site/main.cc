// pangea-site: manages the maps of a server, each in its own folder.

#include "site/command_line.h"

int main(int argc, char** argv) { return pangea::site::RunCommandLine(argc, argv); }
