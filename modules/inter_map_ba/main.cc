#include "inter_map_ba/inter_map_ba_process.h"
#include "server_process/process_main.h"

// KEYFRAME_*, PLACE_MATCH --> InterMapBaProcess --> CONSTRAINT
int main(int argc, char** argv) {
  return pangea::ServerProcessMain<pangea::InterMapBaProcess, pangea::LoopVerifierOptions>(
      argc, argv, "pangea-inter-map-ba",
      "Closes loops: a verification result for every place match within one map");
}
