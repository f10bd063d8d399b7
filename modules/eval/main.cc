// pangea-eval: errors of estimated trajectories against ground truth.

#include "eval/command_line.h"

int main(int argc, char** argv) { return pangea::eval::RunCommandLine(argc, argv); }
