#include "map_points/map_points_process.h"
#include "server_process/process_main.h"

// KEYFRAME_*, MAP_STATE, REFINEMENT, POSE_* --> MapPointsProcess --> LANDMARKS_k
int main(int argc, char** argv) {
  return pangea::ServerProcessMain<pangea::MapPointsProcess>(
      argc, argv, "pangea-map-points",
      "Sends each agent the landmarks of the fused map that it may see next");
}
