#include "fusion/fusion_process.h"
#include "loop_verification/candidate_main.h"

// KEYFRAME_*, PLACE_MATCH --> FusionProcess --> CONSTRAINT
int main(int argc, char** argv) {
  return pangea::CandidateMain<pangea::FusionProcess>(
      argc, argv, "pangea-fusion",
      "Aligns maps: a verification result for every place match between two maps", true);
}
