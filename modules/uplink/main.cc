// pangea-uplink: connects one agent's bus to the link bus.
//
// KEYFRAME_k, POSE_k ─► uplink ─► LINK_UP_k
// CORRECTION_k, LANDMARKS_k ◄─ uplink ◄─ LINK_DOWN_k

#include "uplink/command_line.h"

int main(int argc, char** argv) { return pangea::uplink::RunCommandLine(argc, argv); }
