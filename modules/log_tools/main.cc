// pangea-log: the contents of a captured log, parts of it, and exports to other formats.

#include "log_tools/command_line.h"

int main(int argc, char** argv) { return pangea::log_tools::RunCommandLine(argc, argv); }
