// pangea-link-emulator: emulates a bad link between one agent and the server, for tests and
// measurements.
//
// agent's link bus ◄─► link_emulator ◄─► server's link bus

#include "link_emulator/command_line.h"

int main(int argc, char** argv) { return pangea::link_emulator::RunCommandLine(argc, argv); }
