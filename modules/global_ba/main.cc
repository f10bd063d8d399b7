#include "global_ba/global_ba_process.h"
#include "server_process/process_main.h"

// KEYFRAME_*, PLACE_MATCH, CONSTRAINT, MAP_STATE --> GlobalBaProcess --> REFINEMENT
int main(int argc, char** argv) {
  return pangea::ServerProcessMain<pangea::GlobalBaProcess, pangea::GlobalBaOptions>(
      argc, argv, "pangea-global-ba",
      "Adjusts all keyframes and landmarks of a group at once while it is quiet");
}
