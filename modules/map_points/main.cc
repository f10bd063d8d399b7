#include "bus/process_main.h"
#include "map_points/map_points_process.h"

// KEYFRAME_*, MAP_STATE, REFINEMENT, POSE_* --> MapPointsProcess --> LANDMARKS_k
int main(int argc, char** argv) {
  pangea::YamlOptions none;
  pangea::ScratchFileOptions scratch;
  pangea::CheckpointPlace checkpoint;
  return pangea::ProcessMain(
      argc, argv,
      {"pangea-map-points", "Sends each agent the landmarks of the fused map that it may see next",
       none, &scratch, &checkpoint},
      [&](pangea::Bus& bus) {
        return std::make_unique<pangea::MapPointsProcess>(
            bus, std::make_shared<pangea::ScratchFile>(scratch), checkpoint);
      });
}
