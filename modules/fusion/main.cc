#include "fusion/fusion_process.h"
#include "server_process/process_main.h"

// KEYFRAME_*, PLACE_MATCH --> FusionProcess --> CONSTRAINT
int main(int argc, char** argv) {
  return pangea::ServerProcessMain<pangea::FusionProcess, pangea::LoopVerifierOptions>(
      argc, argv, "pangea-fusion",
      "Aligns maps: a verification result for every place match between two maps");
}
