// pangea-agent-handler: connects the link bus and the server bus, and owns the journal. It also
// makes the agents' keys.
//
// LINK_UP_k ─► agent_handler ─► KEYFRAME_k, HAVE, JOURNAL_FILE
// LINK_DOWN_k ◄─ agent_handler ◄─ CORRECTION_k, LANDMARKS_k, ANCHOR_k, OTHERS_k

#include "agent_handler/command_line.h"

int main(int argc, char** argv) { return pangea::agent_handler::RunCommandLine(argc, argv); }
