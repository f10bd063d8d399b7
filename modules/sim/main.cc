// pangea-sim: renders recordings in EuRoC's format, with exact ground truth.

#include "sim/command_line.h"

int main(int argc, char** argv) { return pangea::sim::RunCommandLine(argc, argv); }
