// pangea-bridge: connects the hosts of a site that has more than one, over NATS.
//
// standby: the site's stream              --> the journal; ends when this host is the core
// core:    the journal, matches --> CoreBridge   --> streams of NATS --> CONSTRAINT
// edge, link: link packets <--> subjects of NATS (LinkBridge)
// worker:  streams of NATS      --> WorkerBridge --> KEYFRAME_*, PLACE_MATCH; CONSTRAINT back

#include "cluster/command_line.h"

int main(int argc, char** argv) { return pangea::cluster::RunCommandLine(argc, argv); }
