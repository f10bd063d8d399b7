// pangea-gateway: lets the browsers of phones join a site, over HTTPS and WebSockets.

#include "gateway/command_line.h"

int main(int argc, char** argv) { return pangea::gateway::RunCommandLine(argc, argv); }
