// pangea-keyframe-player: log of keyframes ─► KEYFRAME_k

#include "replay/command_line.h"

int main(int argc, char** argv) { return pangea::replay::RunCommandLine(argc, argv); }
