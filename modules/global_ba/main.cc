#include "bus/process_main.h"
#include "global_ba/global_ba_process.h"

// KEYFRAME_*, PLACE_MATCH, CONSTRAINT, MAP_STATE --> GlobalBaProcess --> REFINEMENT
int main(int argc, char** argv) {
  return pangea::ServerProcessMain<pangea::GlobalBaProcess, pangea::GlobalBaOptions>(
      argc, argv, "pangea-global-ba",
      "Adjusts all keyframes and landmarks of a group at once while it is quiet");
}
