#include <memory>

#include "common/bus/process.h"
#include "posegraph/posegraph_process.h"
#include "posegraph/posegraph_yaml.h"

// KEYFRAME_*, CONSTRAINT, PLACE_MATCH, REFINEMENT --> PoseGraphProcess --> CORRECTION_*, MAP_STATE
int main(int argc, char** argv) {
  pangea::PoseGraphOptions options;
  pangea::YamlOptions yaml;
  pangea::Bind(yaml, options);
  const pangea::ProcessDescription description{
      "pangea-posegraph", "Groups maps, optimises every keyframe's pose, tells agents their drift",
      yaml.Print()};
  return pangea::ProcessMain(
      argc, argv, description, [&](pangea::Bus& bus, const std::string& options_file) {
        if (!options_file.empty()) {
          yaml.ReadFile(options_file);
        }
        return std::make_unique<pangea::PoseGraphProcess>(bus, options, pangea::WallUtime());
      });
}
