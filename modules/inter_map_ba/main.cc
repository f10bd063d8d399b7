#include "bus/process_main.h"
#include "inter_map_ba/inter_map_ba_process.h"

// KEYFRAME_*, PLACE_MATCH --> InterMapBaProcess --> CONSTRAINT
int main(int argc, char** argv) {
  return pangea::ServerProcessMain<pangea::InterMapBaProcess, pangea::InterMapBaOptions>(
      argc, argv, "pangea-inter-map-ba",
      "Closes loops: a verification result for every place match within one map");
}
