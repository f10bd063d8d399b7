#include <memory>

#include "posegraph/posegraph_process.h"
#include "server_process/process_main.h"

// KEYFRAME_*, CONSTRAINT, PLACE_MATCH, REFINEMENT --> PoseGraphProcess --> CORRECTION_*, MAP_STATE
int main(int argc, char** argv) {
  pangea::PoseGraphOptions options;
  pangea::YamlOptions yaml;
  pangea::CheckpointPlace checkpoint;
  options.Visit(yaml);
  return pangea::ProcessMain(
      argc, argv,
      {"pangea-posegraph", "Groups maps, optimises every keyframe's pose, tells agents their drift",
       yaml, nullptr, &checkpoint},
      [&](pangea::Bus& bus) {
        return std::make_unique<pangea::PoseGraphProcess>(bus, options, pangea::WallUtime(),
                                                          checkpoint);
      });
}
