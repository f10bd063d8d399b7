// pangea-viewer: shows a bus or a log in a browser.

#include "viewer/command_line.h"

int main(int argc, char** argv) { return pangea::viewer::RunCommandLine(argc, argv); }
