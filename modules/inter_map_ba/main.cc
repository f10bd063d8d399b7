#include "inter_map_ba/inter_map_ba_process.h"
#include "loop_verification/candidate_main.h"

// KEYFRAME_*, PLACE_MATCH --> InterMapBaProcess --> CONSTRAINT
int main(int argc, char** argv) {
  return pangea::CandidateMain<pangea::InterMapBaProcess>(
      argc, argv, "pangea-inter-map-ba",
      "Closes loops: a verification result for every place match within one map", false);
}
